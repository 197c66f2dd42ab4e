"""Write a campaign of a virtual bench whose truth is known."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from epv_env.common.command_line import NextStep, add_out, add_plant, add_seed, beside, plant_option
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Domains, Parameters, written_value
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from epv_env.plant.region import Region
from identification.bench.programmes import SUITES, Programme, at_voltage, load_programmes
from identification.bench.session import run_bench
from identification.recordings.campaign_files import check_vacant, write_campaign
from identification.recordings.rules import RULES, rules_of
from identification.report_2003 import SAMPLING_RATE


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the recordings, the true plant, and where both are written."""
    add_out(parser, help="folder of the campaign")
    add_seed(parser, help="of the sensors' noise")
    recordings = parser.add_mutually_exclusive_group()
    recordings.add_argument("--suite", choices=SUITES, default="report", help="which recordings")
    recordings.add_argument("--programme", type=Path, default=None, help="JSON file of other recordings")
    parser.add_argument("--rate", type=float, default=SAMPLING_RATE, help="samples per second")
    add_plant(parser, help="plant file of the truth; default: Table 12")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SYMBOL=VALUE", help="another true value [SI]"
    )
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME=SIZE",
        help="an effect (docs/explanation/effects.md)",
    )
    parser.add_argument("--truth", type=Path, default=None, help="plant file to write the truth to")


def run(options: argparse.Namespace) -> None:
    """Write the campaign. Raises ValueError for a wrong value, or a folder that holds a campaign."""
    check_vacant(options.out)
    plant = load_plant(options.plant)
    rules = rules_of(plant) if options.plant else RULES
    truth = _with_values(plant.parameters, options.set)
    truth = _with_effects(truth, options.effect)
    campaign = run_bench(
        _suite(options, plant), truth, seed=options.seed, rate=options.rate, rules=rules
    )
    write_campaign(campaign, options.out)
    if options.truth is not None:
        _save_truth(truth, options)
    print(f"{len(campaign.recordings)} recordings in {options.out}")
    if options.programme:
        print("to add them to another campaign, see docs/how-to/diagnose-a-gap.md")


def next_step(options: argparse.Namespace) -> NextStep:
    """Calibrate the model on the campaign."""
    words = ("run", options.out, "--out", beside(options.out, "results"), *plant_option(options.plant))
    return NextStep("to calibrate the model on these recordings", words)


def _suite(options: argparse.Namespace, plant: Plant) -> Sequence[Programme]:
    """The recordings to make, at the voltage of the plant's coil."""
    if options.programme:
        return load_programmes(options.programme, plant.sensors)
    return at_voltage(SUITES[options.suite], plant.voltage)


def _save_truth(truth: Parameters, options: argparse.Namespace) -> None:
    """Write the true parameters as a plant file whose region is that one point."""
    plant = load_plant(options.plant)
    truthful = replace(
        plant, parameters=truth, region=Region(centre=truth), diagnosis=None, name="truth", provenance={}
    )
    save_plant(truthful, options.truth)


def _with_values(parameters: Parameters, settings: list[str]) -> Parameters:
    """Parameters with SYMBOL=VALUE settings applied. Raises ValueError for what is not of that form."""
    changes = {}
    for setting in settings:
        symbol, _, text = setting.partition("=")
        changes[symbol] = _number(text, f"--set {setting}: give SYMBOL=VALUE", "--set R=43.5")
    return parameters.replace(**_written(changes, parameters.own_domains))


def _written(values: dict[str, float], own: Domains) -> dict[str, float]:
    """Values by symbol as a person wrote them; ParameterError for one in the wrong unit."""
    return {symbol: written_value(symbol, value, own) for symbol, value in values.items()}


def _with_effects(parameters: Parameters, settings: list[str]) -> Parameters:
    """Parameters with NAME=SIZE effects switched on; commas separate several sizes of one effect."""
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
        parameters = parameters.replace(
            **_written(dict(zip(symbols, values, strict=True)), parameters.own_domains)
        )
    return parameters


def _number(text: str, rule: str, example: str) -> float:
    """The text as a number; ValueError says the rule and gives an example."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{rule} with a number in SI units, as in {example}") from None
