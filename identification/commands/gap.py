"""Which effect causes the gap between model and recordings.

The guide is docs/how-to/diagnose-a-gap.md.
"""

import argparse
from pathlib import Path

from epv_env.common.command_line import writable_folder
from epv_env.common.files import decoded
from identification.commands.options import add_out, add_plant, add_seed
from identification.gap.gap_json import GAP as GAP_FILE
from identification.gap.sentences import verdict_sentence
from identification.report.result_files import as_text
from identification.studies.error_tables.error_table_study import error_table_study
from identification.valve_gap import diagnose
from identification.valve_gap.diagnose import diagnose_campaign


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what is diagnosed, the nominal model, the catalogue, and where the results go."""
    subject = parser.add_mutually_exclusive_group(required=True)
    subject.add_argument(
        "campaign", nargs="?", type=Path, help="folder with campaign.json (docs/reference/files.md)"
    )
    subject.add_argument("--tables", action="store_true", help="diagnose Tables 11, 13 and 15 instead")
    add_out(parser)
    add_seed(parser, help="of resampling and uncertain conditions")
    add_plant(parser, help="plant file of the nominal model; default: Table 10")
    parser.add_argument(
        "--without", action="append", default=[], metavar="CAUSE", help="leave out of the catalogue"
    )
    parser.add_argument("--images", type=writable_folder, default=None, help="of --tables: its figure")


def run(options: argparse.Namespace) -> None:
    """Diagnose what is chosen. Raises ValueError for options that exclude each other."""
    if options.tables:
        _diagnose_tables(options)
    else:
        _diagnose_campaign(options)


def _diagnose_tables(options: argparse.Namespace) -> None:
    if options.plant or options.without:
        raise ValueError("--plant and --without belong to a campaign: leave them out with --tables")
    sections = error_table_study(options.out, seed=options.seed, images=options.images)
    print(as_text(sections))
    print(f"\nwritten: {options.out}/tables.json and tables.html")


def _diagnose_campaign(options: argparse.Namespace) -> None:
    if options.images:
        raise ValueError("--images belongs to --tables: a campaign's figures are in its report.html")
    diagnosis = diagnose_campaign(
        options.campaign, options.out, plant=options.plant, without=options.without, seed=options.seed
    )
    content = decoded(options.out / GAP_FILE, remedy="diagnose again")
    print(verdict_sentence(diagnosis, content["next_experiment"])[1])
    written = (diagnose.REPORT, GAP_FILE, diagnose.PLANT)
    print(f"written: {', '.join(str(options.out / name) for name in written)}")
