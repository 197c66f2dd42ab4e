"""Turn measurement files (MDF, MATLAB, TDMS, Parquet, CSV) into a campaign.

The guide is docs/how-to/use-your-recordings.md.
"""

import argparse
from pathlib import Path

from epv_env.common.command_line import NextStep, Number, add_out, add_plant
from epv_env.plant.plantfile import load_plant
from identification.commands import bench
from identification.importing.import_campaign import (
    import_text,
    read_files,
    read_source,
    source_table,
)
from identification.recordings.campaign_files import check_campaign, check_vacant, write_campaign
from identification.recordings.rules import RULES, rules_of


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the files, the mapping and the ambient conditions."""
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="MDF, MATLAB, TDMS, Parquet or text files"
    )
    add_out(parser, help="folder of the campaign")
    add_plant(parser, help="plant file of another valve than the report's, for the checks")
    parser.add_argument(
        "--mapping", type=Path, default=None, help="JSON file that says what names and units do not"
    )
    parser.add_argument(
        "--ambient-bar",
        type=Number(float, 0.01, 100.0),
        help="pressure of the environment [bar absolute]",
    )
    parser.add_argument(
        "--gauge",
        action="store_true",
        help="pressures are gauge where no unit says gauge or absolute",
    )
    parser.add_argument(
        "--temperature-K", type=Number(float, 1.0, 1000.0), help="of the environment [K]"
    )
    parser.add_argument(
        "--rate",
        type=Number(float, 1.0, 1e7),
        help="samples per second; default: the slowest channel's",
    )
    parser.add_argument("--name", default=None, help="of the campaign; default: the files' folder")
    parser.add_argument("--dry-run", action="store_true", help="show everything and write nothing")


def run(options: argparse.Namespace) -> None:
    """Show what the files hold and write the campaign. Raises ImportingError or CampaignError."""
    check_vacant(options.out)
    rules = rules_of(load_plant(options.plant)) if options.plant else RULES
    for file in options.files:
        print(source_table(read_source(file)), end="\n\n")
    imported = read_files(
        options.files,
        mapping=options.mapping,
        ambient_bar=options.ambient_bar,
        temperature_K=options.temperature_K,
        rate=options.rate,
        name=options.name,
        gauge=options.gauge,
        rules=rules,
    )
    print(import_text(imported), end="\n\n")
    if options.dry_run:
        check_campaign(imported.campaign, options.out)
        print("dry run: all checks passed, nothing is written; leave --dry-run out to import")
        return
    write_campaign(imported.campaign, options.out, provenance=imported.provenance())
    print(f"{len(imported.files)} recordings in {options.out}")


def next_step(options: argparse.Namespace) -> NextStep | None:
    """As after a bench; None after a dry run, which says what to leave out."""
    return None if options.dry_run else bench.next_step(options)
