"""Identification from the command line: `python -m identification COMMAND --help`."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from threadpoolctl import threadpool_limits

from epv_env.common.command_line import fail_clearly, writable_folder
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import load_plant, save_plant
from identification.bench.programme_file import load_programmes
from identification.bench.programmes import SUITES
from identification.bench.session import run_bench
from identification.calibration.calibrate import STARTS
from identification.commands.blind import add_blind, blind
from identification.commands.gap import add_gap, gap
from identification.pipeline.run import PLANT_FILE, run
from identification.pipeline.stages import STAGES, Identification
from identification.recordings.campaign_files import check_vacant, read_campaign, write_campaign
from identification.report.result_files import as_text, write_results
from identification.report_2003.cases import RATE
from identification.studies.coverage.coverage import CAMPAIGNS, coverage_study
from identification.studies.coverage.coverage_section import coverage_json, coverage_section
from identification.studies.reproduction.reproduction import reproduce

JOURNAL = "searches.jsonl"

HELP = {
    "quality": "is the data good enough (section 4)",
    "sensitivity": "which parameters matter (section 5)",
    "calibrate": "fit the parameters (section 6.2)",
    "confidence": "how sure the estimates are (section 6.3)",
    "validate": "does the model hold on held-out recordings (section 7)",
}


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        prog="python -m identification",
        description="Identify the valve from a campaign of recordings (docs/identification.md).",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_bench(commands)
    for stage in STAGES:
        _add_stage(commands, stage, HELP[stage])
    _add_stage(commands, "run", "all of these: plant.json and report.html")
    _add_coverage(commands)
    _add_reproduce(commands)
    add_gap(commands)
    add_blind(commands)
    chosen = parser.parse_args(arguments)
    for name in ("starts", "campaigns", "trials", "workers"):
        value = getattr(chosen, name, None)
        if value is not None and value < 1:
            parser.error(f"--{name} must be at least 1")
    if getattr(chosen, "seed", 0) < 0:
        parser.error("--seed must not be negative")
    return chosen


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    chosen = parse(arguments)
    # The matrices are small: threads of the linear algebra would only wait for each other.
    with threadpool_limits(1):
        COMMANDS.get(chosen.command, _stage)(chosen)
    return 0


def _add_stage(commands: "argparse._SubParsersAction", name: str, text: str) -> None:
    parser = commands.add_parser(name, help=text, description=text)
    parser.add_argument("campaign", help="folder with campaign.json and the recordings (docs/data.md)")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--seed", type=int, default=0, help="of starts, draws and resampling")
    parser.add_argument("--starts", type=int, default=STARTS, help="searches of each method")


def _add_bench(commands: "argparse._SubParsersAction") -> None:
    text = "write a campaign of a virtual bench whose truth is known"
    parser = commands.add_parser("bench", help=text, description=text)
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of the campaign")
    parser.add_argument("--seed", type=int, default=0, help="of the sensors' noise")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--suite", choices=SUITES, default="report", help="which recordings")
    which.add_argument("--programme", type=Path, default=None, help="JSON file of other recordings")
    parser.add_argument("--rate", type=float, default=RATE, help="samples per second")
    parser.add_argument("--plant", default=None, help="plant file of the truth; default: Table 12")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SYMBOL=VALUE", help="another true value [SI]"
    )
    parser.add_argument(
        "--effect", action="append", default=[], metavar="NAME=SIZE", help="an effect (docs/effects.md)"
    )
    parser.add_argument("--truth", type=Path, default=None, help="plant file to write the truth to")


def _add_coverage(commands: "argparse._SubParsersAction") -> None:
    text = "how often the intervals hold the truth, over twin campaigns"
    parser = commands.add_parser("coverage", help=text, description=text)
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--campaigns", type=int, default=CAMPAIGNS, help="number of twin campaigns")
    parser.add_argument("--seed", type=int, default=0, help="of the campaigns' noise")
    parser.add_argument("--workers", type=int, default=None, help="processes; default: all cores")


def _add_reproduce(commands: "argparse._SubParsersAction") -> None:
    text = "the report's tables beside ours"
    parser = commands.add_parser("reproduce", help=text, description=text)
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--seed", type=int, default=0, help="of the virtual bench's noise")


def _bench(chosen: argparse.Namespace) -> None:
    check_vacant(chosen.out)
    truth = _with_values(load_plant(chosen.plant).parameters, chosen.set)
    truth = _with_effects(truth, chosen.effect)
    suite = load_programmes(chosen.programme) if chosen.programme else SUITES[chosen.suite]
    campaign = run_bench(suite, truth, seed=chosen.seed, rate=chosen.rate)
    write_campaign(campaign, chosen.out)
    if chosen.truth is not None:
        plant = load_plant(chosen.plant)
        save_plant(
            type(plant)(parameters=truth, region=type(plant.region)(centre=truth), name="truth"),
            chosen.truth,
        )
    print(f"{len(campaign.recordings)} recordings in {chosen.out}")


def _with_values(parameters: Parameters, settings: list[str]) -> Parameters:
    """Parameters with SYMBOL=VALUE settings applied. Raises ValueError for what is not of that form."""
    changes = {}
    for setting in settings:
        symbol, _, text = setting.partition("=")
        changes[symbol] = _number(text, f"--set {setting}: give SYMBOL=VALUE", "--set R=43.5")
    return parameters.replace(**changes)


def _with_effects(parameters: Parameters, settings: list[str]) -> Parameters:
    """Parameters with NAME=SIZE effects switched on; several sizes of one effect part at commas."""
    for setting in settings:
        name, _, text = setting.partition("=")
        symbols = CATALOGUE.get(name)
        if symbols is None:
            raise ValueError(f"--effect {setting}: unknown effect; known are {', '.join(CATALOGUE)}")
        sizes = text.split(",")
        if len(sizes) != len(symbols):
            raise ValueError(
                f"--effect {setting}: {name} is sized by {', '.join(symbols)}: give a number for each, "
                "parted by commas"
            )
        rule = f"--effect {setting}: give NAME=SIZE"
        values = [_number(size, rule, "--effect piston_friction=8,0") for size in sizes]
        parameters = parameters.replace(**dict(zip(symbols, values, strict=True)))
    return parameters


def _number(text: str, rule: str, example: str) -> float:
    """The text as a number; ValueError says the rule and gives an example."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{rule} with a number in SI units, as in {example}") from None


def _stage(chosen: argparse.Namespace) -> None:
    result = STAGES[chosen.command](_identification(chosen))
    title = f"{chosen.command}: {chosen.campaign}"
    write_results(
        chosen.out, chosen.command, title=title, sections=result.sections, content=result.content
    )
    print(as_text(result.sections))
    print(f"\nwritten: {chosen.out / chosen.command}.html and .json")


def _identification(chosen: argparse.Namespace) -> Identification:
    campaign = read_campaign(chosen.campaign)
    return Identification(campaign, chosen.out / JOURNAL, seed=chosen.seed, starts=chosen.starts)


def _run(chosen: argparse.Namespace) -> None:
    plant = run(_identification(chosen), chosen.out)
    for symbol in plant.region.symbols:
        print(f"{symbol:8} {plant.parameters[symbol]:.7g}")
    print(f"written: {chosen.out / PLANT_FILE}, {chosen.out}/report.html and report.json")


def _coverage(chosen: argparse.Namespace) -> None:
    found = coverage_study(
        journal=chosen.out / "coverage.jsonl",
        campaigns=chosen.campaigns,
        seed=chosen.seed,
        workers=chosen.workers,
    )
    section = coverage_section(found)
    write_results(
        chosen.out, "coverage", title=section.title, sections=[section], content=coverage_json(found)
    )
    print(as_text([section]))


def _reproduce(chosen: argparse.Namespace) -> None:
    sections = reproduce(chosen.out, seed=chosen.seed)
    print(as_text(sections))
    print(f"\nwritten: {chosen.out}/reproduce.json and reproduce.html")


COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "bench": _bench,
    "run": _run,
    "coverage": _coverage,
    "reproduce": _reproduce,
    "gap": gap,
    "blind": blind,
}
"""Commands that are not one stage."""

if __name__ == "__main__":
    sys.exit(fail_clearly(main))
