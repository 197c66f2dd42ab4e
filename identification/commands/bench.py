"""Write a campaign of a virtual bench whose truth is known."""

import argparse
from dataclasses import replace
from pathlib import Path

from epv_env.common.command_line import (
    NextStep,
    add_out,
    add_plant,
    add_seed,
    beside,
    plant_option,
    writable_file,
)
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters, written_value
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from epv_env.plant.region import Region
from identification.bench.programmes import SUITES, at_voltage, load_programmes
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
    parser.add_argument("--truth", type=writable_file, help="plant file to write the truth to")


def run(options: argparse.Namespace) -> None:
    """Write the campaign. Raises ValueError for a wrong value, or a folder that holds a campaign."""
    check_vacant(options.out)
    plant = load_plant(options.plant)
    truth = true_parameters(options, plant)
    if options.programme:
        programmes = load_programmes(options.programme, plant.sensors)
    else:
        programmes = at_voltage(SUITES[options.suite], plant.voltage)
    rules = rules_of(plant) if options.plant else RULES
    campaign = run_bench(programmes, truth, seed=options.seed, rate=options.rate, rules=rules)
    write_campaign(campaign, options.out)
    if options.truth is not None:
        itself = {"parameters": truth, "region": Region(centre=truth), "diagnosis": None}
        save_plant(replace(plant, **itself, name="truth", provenance={}), options.truth)
    print(f"{len(campaign.recordings)} recordings in {options.out}")
    if options.programme:
        print("to add them to another campaign, see docs/how-to/diagnose-a-gap.md")


def next_step(options: argparse.Namespace) -> NextStep:
    """Calibrate the model on the campaign."""
    words = ("run", options.out, "--out", beside(options.out, "results"), *plant_option(options.plant))
    return NextStep("to calibrate the model on these recordings", words)


def true_parameters(options: argparse.Namespace, plant: Plant) -> Parameters:
    """The plant's parameters with what --set and --effect change. Raises ValueError."""
    own = plant.parameters.own_domains
    true = {name: written_value(name, value, own) for name, value in _true_values(options).items()}
    return plant.parameters.replace(**true)


def _true_values(options: argparse.Namespace) -> dict[str, float]:
    """What --set and --effect give, by symbol. Raises ValueError for what is not of their form."""
    values: dict[str, float] = {}
    for setting in options.set:
        symbol, _, text = setting.partition("=")
        values[symbol] = _number(text, f"--set {setting}: give SYMBOL=VALUE", "--set R=43.5")
    for setting in options.effect:
        name, _, text = setting.partition("=")
        symbols, sizes = CATALOGUE.get(name), text.split(",")
        if symbols is None:
            raise ValueError(f"--effect {setting}: unknown effect; known are {', '.join(CATALOGUE)}")
        if len(sizes) != len(symbols):
            raise ValueError(
                f"--effect {setting}: {name} is sized by {', '.join(symbols)}: give a number for each, "
                "parted by commas"
            )
        rule = f"--effect {setting}: give NAME=SIZE"
        for symbol, size in zip(symbols, sizes, strict=True):
            values[symbol] = _number(size, rule, "--effect piston_friction=8,0")
    return values


def _number(text: str, rule: str, example: str) -> float:
    """The text as a number; ValueError says the rule and gives an example."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{rule} with a number in SI units, as in {example}") from None
