"""Which effect causes the gap between model and recordings.

The guide is docs/how-to/diagnose-a-gap.md.
"""

import argparse
from pathlib import Path

from epv_env.common.command_line import NextStep, add_out, add_plant, add_seed
from epv_env.common.files import decoded
from identification.gap.diagnosis import Diagnosis
from identification.gap.report.gap_json import GAP as GAP_FILE
from identification.gap.report.sentences import verdict_sentence
from identification.valve_gap import diagnose, operation


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what is diagnosed, the nominal model, the catalogue, and where the results go."""
    parser.add_argument(
        "campaign", type=Path, help="folder with campaign.json or log.json (docs/reference/files.md)"
    )
    parser.add_argument(
        "--logs", action="store_true", help="the folder holds the log of a control unit, not a campaign"
    )
    add_out(parser)
    add_seed(parser, help="of resampling")
    add_plant(parser, help="plant file of the nominal model; default: Table 10")
    parser.add_argument(
        "--without", action="append", default=[], metavar="CAUSE", help="leave out of the catalogue"
    )


def run(options: argparse.Namespace) -> None:
    """Diagnose the campaign, and say what the verdict means. Raises ValueError."""
    given = {"plant": options.plant, "without": options.without, "seed": options.seed}
    read = operation.diagnose_log if options.logs else diagnose.diagnose_campaign
    say(read(options.campaign, options.out, **given), options.out)
    written = (diagnose.REPORT, GAP_FILE, diagnose.PLANT)
    print(f"written: {', '.join(str(options.out / name) for name in written)}")


def next_step(options: argparse.Namespace) -> NextStep:
    """What the verdict in the folder of results asks for."""
    verdict = decoded(options.out / GAP_FILE, remedy="diagnose again")["verdict"]
    if options.logs:
        return operation.next_step(verdict, options.campaign, options.out, options.plant)
    return diagnose.next_step(verdict, options.campaign, options.out, options.plant)


def say(found: Diagnosis, out: Path) -> None:
    """Print what the verdict means, and what to record next."""
    content = decoded(out / GAP_FILE, remedy="diagnose again")
    print(verdict_sentence(found)[1])
    if content["next_experiment"]:
        print(content["next_experiment"])
