"""A sweep: one thing changed at a time, and regions; tables of violation rates."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from epv_env.plant.consumption import SCENARIOS
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import table
from epv_env.plant.plantfile import Plant
from training.evaluation.metrics import EpisodeMetrics, summary, violation_interval
from training.evaluation.plots import in_words
from training.evaluation.scenarios import effect_levels

JOINT = ("exact", "confidence", "ten_percent", "sensitive_ten_percent")
"""Regions from which every episode draws a plant of its own."""

MS = 1e-3


SENSOR_NOISE = (0.0, 1.0, 2.0, 4.0)
"""Factors on the sensors' noise [1]: from none to what a worn sensor has."""
CONTROL_PERIODS_MS = (2, 5, 10, 20)
"""Control periods [ms]; 5 is the environment's."""
LATENCIES_MS = (1, 2, 5, 10)
"""Delays of the command [ms], up to two control periods."""
SUPPLY_VOLTAGES = (18.0, 21.0, 28.0, 32.0)
"""Supply voltages of the coil [V], nominally 24 V: from a weak battery to a charging fault."""


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
        value = plant.parameters[symbol]
        minus, plus = (0.9 * value, 1.1 * value) if value else (low, high)
        levels = {"-10 %": max(minus, low), "+10 %": min(plus, high), "least": low, "greatest": high}
        for level, value in levels.items():
            yield _changed_plant("parameters", symbol, level, {symbol: value})


def effects(plant: Plant) -> Iterator[Point]:
    """Every effect of the gap catalogue, alone, at three sizes."""
    for effect, level, sizes in effect_levels():
        yield _changed_plant("effects", effect, level, sizes)


def conditions(plant: Plant) -> Iterator[Point]:
    """Consumption, sensor noise, control period, latency and supply voltage, one at a time."""
    changes: dict[str, dict[str, dict[str, Any]]] = {
        "scenario": {name: {"scenario": name} for name in SCENARIOS},
        "sensor noise": {f"{factor:g} x": {"sensor_noise": factor} for factor in SENSOR_NOISE},
        "control period": {f"{ms} ms": {"control_period": ms * MS} for ms in CONTROL_PERIODS_MS},
        "latency": {f"{ms} ms": {"parameters": {"t_delay": ms * MS}} for ms in LATENCIES_MS},
        "supply voltage": {f"{volts:g} V": {"supply_voltage": volts} for volts in SUPPLY_VOLTAGES},
    }
    for factor, levels in changes.items():
        for level, options in levels.items():
            yield Point(design="conditions", factor=factor, level=level, options=options)


def _changed_plant(design: str, factor: str, level: str, values: dict[str, float]) -> Point:
    """The plant with some values changed."""
    return Point(design=design, factor=factor, level=level, options={"parameters": values})


ONE_AT_A_TIME: dict[str, Callable[[Plant], Iterator[Point]]] = {
    "parameters": parameters,
    "effects": effects,
    "conditions": conditions,
}
"""Designs that change one thing at a time, by name."""

DESIGNS = ("regions", *ONE_AT_A_TIME)
"""All designs."""


def chosen_points(plant: Plant, designs: Sequence[str], factors: Sequence[str]) -> list[Point]:
    """The points of some designs.

    Args:
        plant: that is changed.
        designs: some of DESIGNS.
        factors: only these, where a design changes one thing; none: all.

    Raises:
        ValueError: none of the designs changes a factor.
    """
    single = [p for name, make in ONE_AT_A_TIME.items() if name in designs for p in make(plant)]
    known = dict.fromkeys(point.factor for point in single)
    unknown = [factor for factor in factors if factor not in known]
    if unknown:
        raise ValueError(
            f"no factor {', '.join(map(repr, unknown))} in the designs {', '.join(designs)}: choose "
            f"among {', '.join(known) or 'none'}"
        )
    points = list(regions(plant)) if "regions" in designs else []
    return points + [point for point in single if not factors or point.factor in factors]


NAMED_LEVELS = 3
"""Changes that are named for each controller and design: more would not fit a table's cell."""

RANGE_ENDS = ("least", "greatest", "top")
"""Levels at the ends of a range, beyond what a sound valve has; they are counted apart."""

HEADINGS = {
    "level": "plants",
    "controller": "controller",
    "left_text": "violation rate [%]",
    "C1_worst_excursion_bar": "worst excursion [bar]",
    "rms_error_bar": "rms error [bar]",
    "switchings_per_s": "switchings [1/s]",
}
"""Columns of the table of regions."""

Cell = tuple[Point, str]
"""A point of a design under the controller of a label."""


def point_table(
    cells: Sequence[Cell], metrics: Sequence[EpisodeMetrics], first_seed: int
) -> pd.DataFrame:
    """A row for each point and controller.

    Columns: design, factor, level, controller; `left`, the violation rate [1],
    with its exact 95 % interval `left_low`, `left_high`; median excursion; the seed of the worst
    episode; and `summary`."""
    rows = []
    for (point, controller), each in zip(cells, metrics, strict=True):
        low, high = violation_interval(each.stayed)
        rows.append(
            {
                "design": point.design, "factor": point.factor, "level": point.level,
                "controller": controller, "left": 1 - float(np.mean(each.stayed)),
                "left_low": low, "left_high": high,
                "excursion_median_bar": float(np.median(each.excursion_bar)),
                "worst_seed": first_seed + int(np.argmax(each.excursion_bar)), **summary(each),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def share_text(row: Mapping[str, Any]) -> str:
    """Violation rate with its exact interval [%]; row: of `point_table`."""
    low, value, high = (100 * row[name] for name in ("left_low", "left", "left_high"))
    return f"{value:.3g} ({low:.2g} to {high:.2g})"


def region_table(points: pd.DataFrame) -> pd.DataFrame:
    """The regions under each controller, with headings."""
    some: Any = points[points["design"] == "regions"]
    shown = some.assign(
        left_text=[share_text(row) for row in some.to_dict("records")], level=some["level"].map(in_words)
    )
    return shown.loc[:, list(HEADINGS)].rename(columns=HEADINGS)


def hurts(points: pd.DataFrame) -> pd.Series:
    """Of each point whether its exact interval lies above that of the plant as it is, (points,)."""
    exact: Any = points[points["level"] == "exact"].set_index("controller")["left_high"]
    bounds: Any = points["controller"].map(exact)
    return points["left_low"] > bounds.fillna(0.0)


def harmful_changes(points: pd.DataFrame) -> pd.DataFrame:
    """How many changes of one thing raise the violation rate, and which ones most."""
    rows, points = [], points.assign(hurts=hurts(points))
    for controller, mine in points.groupby("controller", sort=False):
        for design in ONE_AT_A_TIME:
            tried: Any = mine[mine["design"] == design]
            for ends in (False, True):
                some = tried[tried["level"].isin(RANGE_ENDS) == ends]
                if len(some) == 0:
                    continue
                hurt = some[some["hurts"]].sort_values("left", ascending=False, kind="stable")
                named = [
                    f"{row['factor']} {row['level']} ({100 * row['left']:.3g})"
                    for row in hurt.head(NAMED_LEVELS).to_dict("records")
                ]
                rows.append(
                    {
                        "controller": controller,
                        "changed": f"{design}, ends of their ranges" if ends else design,
                        "tried": len(some), "hurt": len(hurt),
                        "highest violation rate [%]": "; ".join(named) or "–",
                    }
                )  # fmt: skip
    return pd.DataFrame(rows)
