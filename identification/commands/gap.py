"""Which effect causes the gap between model and recordings.

The guide is docs/how-to/diagnose-a-gap.md.
"""

import argparse
from functools import partial
from pathlib import Path

from epv_env.common.command_line import NextStep, Number, add_out, add_plant, add_seed, plant_option
from epv_env.common.files import decoded
from epv_env.plant.plantfile import load_plant
from identification.gap.diagnosis import Diagnosis
from identification.gap.gap_json import GAP as GAP_FILE
from identification.gap.screened import sentences
from identification.gap.sentences import verdict_sentence
from identification.gap.verdict import AMBIGUOUS
from identification.valve_gap import diagnose, operation
from identification.valve_gap.rounds import Bench, extended_campaign, recorded, rounds

ROUNDS = Number(int, 1, 100)
"""Recordings that the virtual bench may add."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what is diagnosed, the nominal model, the catalogue, and where the results go."""
    parser.add_argument(
        "campaign", type=Path, help="folder with campaign.json or log.json (docs/reference/files.md)"
    )
    parser.add_argument(
        "--logs", action="store_true", help="the folder holds the log of a control unit, not a campaign"
    )
    add_out(parser)
    add_seed(parser, help="of resampling, and of the noise of recordings that are added")
    add_plant(parser, help="plant file of the nominal model; default: Table 10")
    parser.add_argument(
        "--without", action="append", default=[], metavar="CAUSE", help="leave out of the catalogue"
    )
    parser.add_argument(
        "--rounds",
        type=ROUNDS,
        metavar="N",
        help="virtual bench: record what is proposed, at most N times, until one answer holds 95 %%",
    )
    parser.add_argument(
        "--bench", type=Path, metavar="TRUTH", help="plant file of that bench, from epv bench --truth"
    )


def run(options: argparse.Namespace) -> None:
    """Diagnose the campaign, and say what the verdict means. Raises ValueError."""
    _check(options)
    given = {"plant": options.plant, "without": options.without, "seed": options.seed}
    if options.rounds:
        bench = Bench(truth=load_plant(options.bench), seed=options.seed)
        diagnose_all = partial(diagnose.diagnose_campaign, **given)
        for each in rounds(options.campaign, options.out, options.rounds, bench, diagnose_all):
            print(f"{each.added} recordings added: ", end="")
            say(each.found, options.out)
    else:
        read = operation.diagnose_log if options.logs else diagnose.diagnose_campaign
        say(read(options.campaign, options.out, **given), options.out)
    written = (diagnose.REPORT, GAP_FILE, diagnose.PLANT)
    print(f"written: {', '.join(str(options.out / name) for name in written)}")


def next_step(options: argparse.Namespace) -> NextStep:
    """What the verdict in the folder of results asks for."""
    verdict = decoded(options.out / GAP_FILE, remedy="diagnose again")["verdict"]
    if options.logs:
        return operation.next_step(verdict, options.campaign, options.out, options.plant)
    if options.rounds and verdict == AMBIGUOUS:
        more = ("--rounds", options.rounds + 1, "--bench", options.bench, *plant_option(options.plant))
        return NextStep("for a further round", ("gap", options.campaign, "--out", options.out, *more))
    added = min(recorded(options.out), options.rounds or 0)
    campaign = extended_campaign(options.campaign, options.out, added)
    return diagnose.next_step(verdict, campaign, options.out, options.plant)


def _check(options: argparse.Namespace) -> None:
    """Raise ValueError for options that do not go together."""
    if (options.rounds is None) != (options.bench is None):
        raise ValueError(
            "--rounds and --bench go together: give both for a virtual bench; on a real bench, record "
            "next.json yourself and diagnose again (docs/how-to/diagnose-a-gap.md)"
        )
    if options.rounds and options.logs:
        raise ValueError("--rounds records for campaigns, not for logs: leave out --logs or --rounds")


def say(found: Diagnosis, out: Path) -> None:
    """Print what the verdict means, and which readings were left out."""
    content = decoded(out / GAP_FILE, remedy="diagnose again")
    print(verdict_sentence(found, content["next_experiment"])[1])
    for sentence in sentences(found.screened):
        print(f"Left out: {sentence}.")
