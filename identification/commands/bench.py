"""Write a campaign of a virtual bench whose truth is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Folder, PlantFile, Seed, writable_file
from epv_env.plant.effects.registry import CATALOGUE, effect
from epv_env.plant.parameters import Parameters, written_value
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from epv_env.plant.region import Region
from identification.bench.programmes import SUITES, at_voltage, load_programmes
from identification.bench.session import run_bench
from identification.recordings.campaign_files import check_vacant, write_campaign
from identification.recordings.recording import rules_of
from identification.report_2003 import SAMPLING_RATE


@dataclass(frozen=True, kw_only=True)
class Options:
    """The recordings, the true plant, and where both are written."""

    out: Annotated[Folder, "folder of the campaign"]
    seed: Annotated[Seed, "of the sensors' noise"] = 0
    suite: Annotated[str, {"choices": SUITES, "group": "recordings"}, "which recordings"] = "report"
    programme: Annotated[Path | None, {"group": "recordings"}, "JSON file of other recordings"] = None
    rate: Annotated[float, "samples per second"] = SAMPLING_RATE
    plant: Annotated[PlantFile, "plant file of the truth; default: Table 12"] = None
    set: Annotated[
        Sequence[str], {"action": "append", "metavar": "SYMBOL=VALUE"}, "another true value [SI]"
    ] = ()
    effect: Annotated[
        Sequence[str], {"action": "append", "metavar": "NAME[=SIZE]"},
        "an effect, of typical size unless given (docs/explanation/effects.md)",
    ] = ()  # fmt: skip
    truth: Annotated[Path | None, writable_file, "plant file to write the truth to"] = None


def run(options: Options) -> None:
    """Write the campaign. Raises ValueError for a wrong value, or a folder that holds a campaign."""
    check_vacant(options.out)
    plant = load_plant(options.plant)
    truth = true_parameters(options, plant)
    if options.programme:
        programmes = load_programmes(options.programme, plant.sensors)
    else:
        programmes = at_voltage(SUITES[options.suite], plant.voltage)
    campaign = run_bench(programmes, truth, seed=options.seed, rate=options.rate, rules=rules_of(plant))
    if options.truth is not None:
        itself = {"parameters": truth, "region": Region(centre=truth), "diagnosis": None}
        save_plant(replace(plant, **itself, name="truth", provenance={}), options.truth)
    write_campaign(campaign, options.out)  # campaign.json last: whoever finds it has the truth, too
    print(f"{len(campaign.recordings)} recordings in {options.out}")
    if options.programme:
        print("to add them to another campaign, see docs/how-to/diagnose-a-gap.md")


def next_step(options: Options) -> NextStep:
    """Calibrate the model on the campaign."""
    words = ("run", options.out, "--out", beside(options.out, "results"))
    return NextStep("to calibrate the model on these recordings", words, options.plant)


def true_parameters(options: Options, plant: Plant) -> Parameters:
    """The plant's parameters with what --set and --effect change. Raises ValueError."""
    values: dict[str, float] = {}
    for setting in options.set:
        symbol, _, text = setting.partition("=")
        values[symbol] = _number(text, f"--set {setting}: give SYMBOL=VALUE", "--set R=43.5")
    for setting in options.effect:
        values |= effect_sizes(setting)
    own = plant.parameters.own_domains
    true = {name: written_value(name, value, own) for name, value in values.items()}
    return plant.parameters.replace(**true)


def effect_sizes(setting: str) -> dict[str, float]:
    """Sizes of an effect by symbol: given as NAME=SIZE, or typical for NAME alone. Raises ValueError."""
    name, given, text = setting.partition("=")
    symbols, sizes = CATALOGUE.get(name), text.split(",")
    if symbols is None:
        raise ValueError(f"--effect {setting}: unknown effect; known are {', '.join(CATALOGUE)}")
    if not given:
        return {size.symbol: size.typical for size in effect(name).drawn[0]}
    if not len(effect(name).strengths) <= len(sizes) <= len(symbols):
        raise ValueError(
            f"--effect {setting}: {name} is sized by {', '.join(symbols)}: give a number for each, "
            "parted by commas"
        )
    rule, example = f"--effect {setting}: give NAME=SIZE", "--effect piston_friction=8,0"
    return {s: _number(size, rule, example) for s, size in zip(symbols, sizes, strict=False)}


def _number(text: str, rule: str, example: str) -> float:
    """The text as a number; ValueError says the rule and gives an example."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{rule} with a number in SI units, as in {example}") from None
