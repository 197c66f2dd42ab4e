"""Write the log that a control unit would write of a simulated valve, to try what reads logs.

    epv log --out LOGS                                                    # a valve that stays as it is
    epv log --effect piston_friction --from-drive 5 --out LOGS            # one that changes

`epv gap LOGS --logs` and `epv monitor LOGS` read it.
"""

from dataclasses import dataclass
from typing import Annotated

from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Folder, Number, PlantFile, Seconds, Seed
from epv_env.common.results_folder import progress
from epv_env.plant.consumption import check_scenario
from epv_env.plant.plantfile import load_plant
from identification.commands.bench import effect_sizes
from training.drives import DRIVE, write_log
from training.evaluation.named import HELP, SHIPPED, named_controllers

DRIVES = Number(int, 1, 10_000)


@dataclass(frozen=True, kw_only=True)
class Options:
    """The valve, what becomes of it, and its controller."""

    out: Annotated[Folder, "folder of the log"]
    controller: Annotated[str, HELP] = SHIPPED
    effect: Annotated[
        str | None,
        {"metavar": "NAME[=SIZE]"},
        "of the valve, of typical size unless given (docs/explanation/effects.md)",
    ] = None
    from_drive: Annotated[int, DRIVES, "first drive with the effect"] = 1
    drives: Annotated[int, DRIVES, "number of drives"] = 10
    duration: Annotated[Seconds, "of a drive [s]"] = DRIVE
    scenario: Annotated[str, "consumption"] = "mixed"
    seed: Annotated[Seed, "of the first drive; the others follow"] = 0
    plant: PlantFile = None


def run(options: Options) -> None:
    """Write log.json and a CSV file for each drive.

    Raises ValueError for a controller that can write no log, an unknown effect or scenario, or a folder
    that holds files.
    """
    plant = load_plant(options.plant)
    check_scenario(options.scenario)
    if options.from_drive > options.drives:
        raise ValueError(
            f"--from-drive {options.from_drive} comes after the last of {options.drives} drives: give a "
            "smaller number, or more --drives"
        )
    (controller,) = named_controllers([options.controller], plant)[0].values()
    effects = {}
    if options.effect is not None:
        effects[options.effect.partition("=")[0]] = effect_sizes(options.effect)
    seeds = range(options.seed, options.seed + options.drives)
    write_log(
        options.out, controller, plant, progress(seeds, what="drives"), duration=options.duration,
        scenario=options.scenario, effects=effects, onset=options.from_drive - 1,
    )  # fmt: skip
    print(f"{options.drives} drives of {controller.name!r} in {options.out}")


def next_step(options: Options) -> NextStep:
    """Follow the log with a monitor."""
    words = ("monitor", options.out, "--out", beside(options.out, "monitor"))
    return NextStep("to see whether the valve has changed, and when", words, options.plant)
