"""`python -m identification import`: measurement files of a bench become a campaign."""

import argparse
from pathlib import Path

from epv_env.common.command_line import check_positive
from epv_env.plant.plantfile import load_plant
from identification.commands.command import Command
from identification.commands.options import add_out, add_plant
from identification.importing.import_campaign import (
    check_imported,
    import_text,
    read_files,
    read_source,
    source_table,
)
from identification.recordings.campaign_files import check_vacant, write_campaign
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
        "--ambient-bar", type=float, default=None, help="pressure of the environment [bar absolute]"
    )
    parser.add_argument(
        "--temperature-K", dest="temperature_K", type=float, default=None, help="of the environment [K]"
    )
    parser.add_argument(
        "--rate", type=float, default=None, help="samples per second; default: the slowest channel's"
    )
    parser.add_argument("--name", default=None, help="of the campaign; default: the files' folder")
    parser.add_argument("--dry-run", action="store_true", help="show everything and write nothing")
    parser.set_defaults(
        check=lambda chosen: check_positive(parser, chosen, "rate", "ambient_bar", "temperature_K")
    )


def run(chosen: argparse.Namespace) -> None:
    """Show what the files hold and write the campaign. Raises ImportingError or CampaignError."""
    chosen.check(chosen)
    check_vacant(chosen.out)
    rules = rules_of(load_plant(chosen.plant)) if chosen.plant else RULES
    for file in chosen.files:
        print(source_table(read_source(file)), end="\n\n")
    imported = read_files(
        chosen.files,
        mapping=chosen.mapping,
        ambient_bar=chosen.ambient_bar,
        temperature_K=chosen.temperature_K,
        rate=chosen.rate,
        name=chosen.name,
        rules=rules,
    )
    print(import_text(imported), end="\n\n")
    if chosen.dry_run:
        check_imported(imported, chosen.out)
        print("dry run: all checks passed, nothing is written")
        return
    write_campaign(imported.campaign, chosen.out, provenance=imported.provenance())
    print(f"{len(imported.files)} recordings in {chosen.out}")


IMPORT = Command(
    name="import",
    help="turn measurement files (MDF, MATLAB, TDMS, Parquet, CSV) into a campaign",
    guide="docs/how-to/use-your-recordings.md",
    add_options=add_options,
    run=run,
)
"""The command, for the registry."""
