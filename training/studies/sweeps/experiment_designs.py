"""The conditions of a sweep: one thing changed at a time, regions, and a Latin hypercube."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from epv_env.plant.consumption import SCENARIOS
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import table
from epv_env.plant.plantfile import Plant
from epv_env.settings import as_region
from identification.sensitivity.one_at_a_time import changed_values
from training.evaluation.effect_levels import effect_levels
from training.studies.sweeps.parameter_space import Space

JOINT = ("exact", "confidence", "ten_percent", "sensitive_ten_percent")
"""Regions from which every episode draws a plant of its own."""

SAMPLED = "sensitive_ten_percent"
"""Region of the Latin hypercube."""

MS = 1e-3


@dataclass(frozen=True, kw_only=True)
class ConditionLevels:
    """Levels at which the conditions are tried, from gentle to beyond what the valve is made for."""

    sensor_noise: tuple[float, ...] = (0.0, 1.0, 2.0, 4.0)
    """Factors on the sensors' noise [1]."""
    control_period_ms: tuple[int, ...] = (2, 5, 10, 20)
    """Control periods [ms]."""
    latency_ms: tuple[int, ...] = (1, 2, 5, 10)
    """Delays of the command [ms]."""
    supply_voltage: tuple[float, ...] = (18.0, 21.0, 28.0, 32.0)
    """Supply voltages of the coil [V], nominally 24 V."""


LEVELS = ConditionLevels()


@dataclass(frozen=True, kw_only=True)
class Point:
    """Conditions under which every controller runs the same episodes."""

    design: str
    """One of DESIGNS."""
    factor: str
    """What is changed."""
    level: str
    """How far, in words."""
    options: dict[str, Any] = field(default_factory=dict)
    """Of the environment."""
    parameters: list[dict[str, float]] | None = None
    """A plant for each episode, where the options do not say which."""


def regions(plant: Plant) -> Iterator[Point]:
    """The plant itself, its confidence region, and +-10 % of four and of all sensitive parameters."""
    for name in JOINT:
        if name != "confidence" or plant.region.varies:
            yield Point(design="regions", factor="region", level=name, options={"parameters": name})


def parameters(plant: Plant) -> Iterator[Point]:
    """Each parameter of Tables 6 and 7 and the environment's: +-10 %, and the ends of its domain."""
    effects = {symbol for symbols in CATALOGUE.values() for symbol in symbols}
    for symbol, row in table().items():
        if row.domain is None or row.group == "unmodelled" or symbol in effects:
            continue
        low, high = plant.parameters.domain(symbol)
        minus, plus = changed_values(symbol, plant.parameters[symbol])
        levels = {"-10 %": max(minus, low), "+10 %": min(plus, high), "least": low, "greatest": high}
        for level, value in levels.items():
            yield _changed_plant("parameters", symbol, level, {symbol: value})


def effects(plant: Plant) -> Iterator[Point]:
    """Every effect of the gap catalogue, alone, at three sizes."""
    for effect, level, sizes in effect_levels():
        yield _changed_plant("effects", effect, level, sizes)


def conditions(plant: Plant, levels: ConditionLevels = LEVELS) -> Iterator[Point]:
    """Consumption, sensor noise, control period, latency and supply voltage, one at a time."""
    for name in SCENARIOS:
        yield Point(design="conditions", factor="scenario", level=name, options={"scenario": name})
    for factor in levels.sensor_noise:
        yield Point(
            design="conditions", factor="sensor noise", level=f"{factor:g} x",
            options={"sensor_noise": factor},
        )  # fmt: skip
    for ms in levels.control_period_ms:
        yield Point(
            design="conditions", factor="control period", level=f"{ms} ms",
            options={"control_period": ms * MS},
        )  # fmt: skip
    for ms in levels.latency_ms:
        yield _changed_plant("conditions", "latency", f"{ms} ms", {"t_delay": ms * MS})
    for volts in levels.supply_voltage:
        yield Point(
            design="conditions", factor="supply voltage", level=f"{volts:g} V",
            options={"supply_voltage": volts},
        )  # fmt: skip


def hypercube(plant: Plant, points: int, seed: int) -> Point:
    """A Latin hypercube over SAMPLED, one plant for each episode."""
    space = Space(region=as_region(SAMPLED, plant))
    plants = space.values(space.latin_hypercube(points, seed))
    return Point(design="hypercube", factor=SAMPLED, level="Latin hypercube", parameters=plants)


def _changed_plant(design: str, factor: str, level: str, values: dict[str, float]) -> Point:
    """The plant with some values changed."""
    return Point(design=design, factor=factor, level=level, options={"parameters": values})


ONE_AT_A_TIME: dict[str, Callable[[Plant], Iterator[Point]]] = {
    "parameters": parameters,
    "effects": effects,
    "conditions": conditions,
}
"""Designs that change one thing at a time, by name."""

DESIGNS = ("regions", *ONE_AT_A_TIME, "hypercube", "worst")
"""All designs; the last is no list of points but a search (worst_case_search.py)."""
