"""Diagnose a log, and show what the gap costs its controller: figures as logged and as simulated.

    epv closed-loop logs/valve-01 --controller runs/policy --out runs/gap

It writes what `epv gap LOGS --logs` writes, and takes up its finished fits. The report has one section
more. The guide is docs/how-to/diagnose-a-gap.md.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from epv_env.common.command_line import NextStep
from epv_env.common.options import Folder, PlantFile, Seed
from epv_env.plant.plantfile import load_plant
from identification.recordings.log_files import read_log
from identification.recordings.recording import rules_of
from training.closed_loop import ClosedLoop
from training.evaluation.named import HELP, SHIPPED, named_controllers


@dataclass(frozen=True)
class Options:
    """The log, its controller, the nominal model, the catalogue, and where the results go."""

    log: Annotated[Path, "folder with log.json (docs/reference/files.md)"]
    _: KW_ONLY
    controller: Annotated[str, f"that wrote the log: {HELP}"] = SHIPPED
    out: Folder
    seed: Annotated[Seed, "of resampling"] = 0
    plant: Annotated[PlantFile, "plant file of the nominal model; default: the report's calibration"] = (
        None
    )
    without: Annotated[
        Sequence[str], {"action": "append", "metavar": "CAUSE"}, "leave out of the catalogue"
    ] = ()


def run(options: Options) -> None:
    """Diagnose the log, and compare its controller's figures. Raises ValueError."""
    # Imported here: with the extra `identification`, which the other commands do without.
    from identification.commands.gap import say
    from identification.valve_gap.diagnose import REPORT
    from identification.valve_gap.operation import diagnose_log

    nominal = load_plant(options.plant)
    (controller,) = named_controllers([options.controller], nominal)[0].values()
    loop = ClosedLoop(read_log(options.log, rules_of(nominal)), nominal, controller)
    found = diagnose_log(
        options.log, options.out, plant=options.plant, without=options.without, seed=options.seed,
        more=loop.sections,
    )  # fmt: skip
    say(found, options.out)
    print(f"written: {options.out / REPORT}")


def next_step(options: Options) -> NextStep:
    """What the verdict in the folder of results asks for."""
    from identification.commands import gap

    return gap.next_step(gap.Options(options.log, logs=True, out=options.out, plant=options.plant))
