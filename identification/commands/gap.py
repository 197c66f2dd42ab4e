"""`python -m identification gap`: diagnose a campaign, or the report's own error tables."""

import argparse
import json
from pathlib import Path

from epv_env.common.command_line import writable_folder
from identification.gap.report.verdict_sentences import verdict_sentence
from identification.report.result_files import as_text
from identification.studies.error_tables.error_table_study import error_table_study
from identification.valve_gap.diagnose import GAP, PLANT, REPORT, diagnose_campaign


def add_gap(commands: "argparse._SubParsersAction") -> None:
    """The command's options."""
    text = "which effect causes the gap between model and recordings"
    parser = commands.add_parser("gap", help=text, description=f"{text} (docs/gap.md)")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("campaign", nargs="?", type=Path, help="folder with campaign.json (docs/data.md)")
    what.add_argument("--tables", action="store_true", help="diagnose Tables 11, 13 and 15 instead")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--seed", type=int, default=0, help="of resampling and uncertain conditions")
    parser.add_argument(
        "--plant", default=None, help="plant file of the nominal model; default: Table 10"
    )
    parser.add_argument(
        "--without", action="append", default=[], metavar="CAUSE", help="leave out of the catalogue"
    )
    parser.add_argument("--images", type=writable_folder, default=None, help="of --tables: its figure")


def gap(chosen: argparse.Namespace) -> None:
    """Run the command. Raises ValueError for options that do not go together."""
    if chosen.tables:
        if chosen.plant or chosen.without:
            raise ValueError("--plant and --without belong to a campaign: leave them out with --tables")
        sections = error_table_study(chosen.out, seed=chosen.seed, images=chosen.images)
        print(as_text(sections))
        print(f"\nwritten: {chosen.out}/tables.json and tables.html")
        return
    if chosen.images:
        raise ValueError("--images belongs to --tables: a campaign's figures are in its report.html")
    found = diagnose_campaign(
        chosen.campaign, chosen.out, plant=chosen.plant, without=chosen.without, seed=chosen.seed
    )
    content = json.loads((chosen.out / GAP).read_text(encoding="utf-8"))
    print(verdict_sentence(found, content["next_experiment"])[1])
    print(f"written: {', '.join(str(chosen.out / name) for name in (REPORT, GAP, PLANT))}")
