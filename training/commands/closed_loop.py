"""Diagnose a log, and show what the gap costs its controller: figures as logged and as simulated.

    epv closed-loop logs/valve-01 --controller runs/policy --out runs/gap

It writes what `epv gap LOGS --logs` writes, and takes up its finished fits. The report has one section
more. The guide is docs/how-to/diagnose-a-gap.md.
"""

import argparse
from pathlib import Path

from controllers.policy import TRAINED
from epv_env.common.command_line import NextStep, add_out, add_plant, add_seed
from epv_env.common.files import decoded
from epv_env.plant.plantfile import load_plant
from identification.gap.report.gap_json import GAP
from identification.recordings.log_files import read_log
from identification.recordings.rules import RULES, rules_of
from training.closed_loop import ClosedLoop
from training.evaluation.named import HELP, named_controllers


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the log, its controller, the nominal model, the catalogue, and where the results go."""
    parser.add_argument("log", type=Path, help="folder with log.json (docs/reference/files.md)")
    parser.add_argument(
        "--controller", default=str(TRAINED),
        help=f"that wrote the log: one of {HELP} (default: the package's policy)",
    )  # fmt: skip
    add_out(parser)
    add_seed(parser, help="of resampling")
    add_plant(parser, help="plant file of the nominal model; default: the report's calibration")
    parser.add_argument(
        "--without", action="append", default=[], metavar="CAUSE", help="leave out of the catalogue"
    )


def run(options: argparse.Namespace) -> None:
    """Diagnose the log, and compare its controller's figures. Raises ValueError."""
    # Imported here: with the extra `identification`, which the other commands do without.
    from identification.commands.gap import say
    from identification.valve_gap.diagnose import REPORT
    from identification.valve_gap.operation import diagnose_log

    given = load_plant(options.plant)
    named, _ = named_controllers([options.controller], given)
    log = read_log(options.log, rules_of(given) if options.plant else RULES)
    loop = ClosedLoop(log, given, next(iter(named.values())))
    found = diagnose_log(
        options.log, options.out, plant=options.plant, without=options.without, seed=options.seed,
        more=loop.sections,
    )  # fmt: skip
    say(found, options.out)
    print(f"written: {options.out / REPORT}")


def next_step(options: argparse.Namespace) -> NextStep:
    """What the verdict in the folder of results asks for."""
    from identification.valve_gap.operation import next_step as after

    verdict = decoded(options.out / GAP, remedy="diagnose again")["verdict"]
    return after(verdict, options.log, options.out, options.plant)
