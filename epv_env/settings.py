"""What a user may write for an environment's arguments, and the settings that they become."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from os import PathLike
from typing import Annotated, Any

import numpy as np

from epv_env.common.units import BAR
from epv_env.conditions import Conditions, as_conditions
from epv_env.plant.consumption import MIXED, Scenario, check_scenario
from epv_env.plant.effects.registry import effect
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.plant.region import DIAGNOSIS, Mixture, Region
from epv_env.plant.supply import Supply
from epv_env.reward import EMPTY_CIRCUIT_BAR, LARGEST, WIDEST_BAND_BAR, RewardWeights
from epv_env.signals import (
    PRESSURE_LIMITS_BAR,
    MovingTarget,
    OptionError,
    Range,
    RecordedConsumption,
    as_number,
    as_range,
    check_known,
    check_limits,
    shown,
)


def as_plant(value: Any) -> Plant:
    """A Plant from itself, the path of a plant file, or None (the report's calibration)."""
    if not isinstance(value, (Plant, str, PathLike, type(None))):
        raise OptionError(f"plant is {shown(value)}: give the path of a plant file, a Plant, or None")
    return load_plant(value)


def _plain(value: Any) -> Any:
    """Arrays and pairs as lists; whole numbers beyond a float's range infinite: no domain holds them."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return np.inf if isinstance(value, int) and abs(value) > LARGEST else value


def _choices(values: Mapping[str, Any]) -> dict[str, Any]:
    return {symbol: _plain(value) for symbol, value in values.items()}


def as_region(value: Any, plant: Plant) -> Region | Mixture:
    """A region from its name, from values and ranges by symbol, from Parameters, or as it is."""
    if isinstance(value, (Region, Mixture)):
        return value
    if isinstance(value, Parameters):
        return Region(centre=value)
    if isinstance(value, Mapping):
        return Region(centre=plant.parameters).changed(_choices(value))
    if not isinstance(value, str):
        raise OptionError(
            f"parameters is {shown(value)}: give the name of a region, a mapping of values and "
            "(low, high) by symbol, Parameters, a Region, or a Mixture"
        )
    if value == "confidence":
        if not plant.region.varies:
            raise OptionError(
                f"plant {plant.name!r} has no confidence region: give ranges by symbol, or a plant "
                "file from identification"
            )
        return plant.region
    if value == DIAGNOSIS:
        if plant.diagnosis is None:
            raise OptionError(
                f"plant {plant.name!r} has no alternatives to draw from: give the plant file of a "
                "diagnosis (`epv gap`), or another region"
            )
        return plant.diagnosis
    return Region.named(value, plant.parameters)


def as_supply(value: Any) -> Supply:
    """A Supply, from itself, a constant pressure or range [bar absolute], or None (reservoirs)."""
    if value is None:
        return Supply.reservoirs()
    if isinstance(value, Supply):
        return value
    return Supply.constant(*as_range("supply", value))


def as_target(value: Any) -> Range | MovingTarget:
    """A target from a number, (low, high), a function of the time [s], or a MovingTarget."""
    if isinstance(value, MovingTarget):
        return value
    if callable(value):
        function: Any = value
        return MovingTarget(at=function)
    return as_range("target_bar", value)


def as_scenario(value: Any) -> str | Scenario | RecordedConsumption:
    """A scenario, its name, or a recording of the consumption. Raises ValueError."""
    if not isinstance(value, (str, Scenario, RecordedConsumption)):
        raise OptionError(
            f"scenario is {shown(value)}: give the name of one, a Scenario, or a RecordedConsumption"
        )
    return value if isinstance(value, RecordedConsumption) else check_scenario(value)


def as_weights(value: Any, band_bar: Any) -> RewardWeights:
    """Weights from themselves, a mapping of some by name, or None; band_bar: the band's half-width."""
    if value is None:
        value = RewardWeights()
    if isinstance(value, Mapping):
        check_known("reward weight", value, [entry.name for entry in fields(RewardWeights)])
        value = RewardWeights(**value)
    if not isinstance(value, RewardWeights):
        raise OptionError(f"weights is {shown(value)}: give a RewardWeights, or a mapping of its fields")
    if band_bar is None:
        return value
    return replace(value, band_bar=as_number("band_bar", band_bar, (0.0, WIDEST_BAND_BAR)))


def as_effects(value: Any) -> dict[str, Any]:
    """Sizes of effects by symbol, each a number or (low, high) [SI].

    value: by the effect's name its strength, or a mapping of sizes by symbol, which an effect needs that
    has several strengths; None: none.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise OptionError(f"effects is {shown(value)}: give a mapping from an effect's name to its size")
    sizes: dict[str, Any] = {}
    for name, size in value.items():
        symbols, strengths = effect(name).symbols, effect(name).strengths
        by_symbol = size if isinstance(size, Mapping) else dict.fromkeys(strengths, size)
        if (not isinstance(size, Mapping) and len(strengths) > 1) or set(by_symbol) - set(symbols):
            raise OptionError(
                f"effect {name} is sized by {', '.join(symbols)}: give a mapping from these symbols to "
                "values or (low, high)"
            )
        sizes |= _choices(by_symbol)
    return sizes


OPTIONS = ("parameters", "effects", "scenario", "supply", "target_bar", "p2_bar", "p3_bar", "conditions")
"""Keys that reset(options=...) understands, beside Gymnasium's "reset_mask"."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Everything that defines the task; units in the names, ranges drawn uniformly per episode."""

    region: Region | Mixture
    """From which the plant's parameters are drawn, but the sizes of `effects`."""
    effects: Mapping[str, Any] = field(default_factory=dict)
    """Sizes of effects by symbol, a number or (low, high) [SI]; the others are the region's."""
    control_period: Annotated[float, (0.5e-3, 0.1)]
    """Time between decisions [s]."""
    supply: Supply = field(default_factory=Supply.reservoirs)
    """Supply of the input chamber."""
    scenario: str | Scenario | RecordedConsumption = MIXED
    """Consumption: a name, a scenario of one's own, or a recording."""
    target_bar: Range | MovingTarget = (6.0, 9.5)
    """Target pressure [bar absolute]."""
    p2_bar: Annotated[Range | None, PRESSURE_LIMITS_BAR] = None
    """First circuit pressure; None: `drop_bar` below the target (an excess could not be undone)."""
    p3_bar: Annotated[Range | None, PRESSURE_LIMITS_BAR] = None
    """First control pressure; None: p1, the energised steady state."""
    drop_bar: Annotated[Range, (0.0, 16.0)] = (0.0, 2.0)
    """How far the first circuit pressure lies below the target [bar]."""
    supply_voltage: Annotated[float, (0.1, 32.0)] = 24.0
    """Solenoid voltage when on [V]; up to the sensor's end (Table 1)."""
    settling_time: Annotated[float, (0.0, 3600.0)] = 0.5
    """Time after which the band of C1 has to hold [s]."""
    sensor_noise: Annotated[float, (0.0, 1000.0)] = 1.0
    """Standard deviations of the sensors' noise relative to Table 3's; True is 1, False is 0. Beyond
    1000, every reading is at an end of its range."""
    weights: RewardWeights = field(default_factory=RewardWeights)
    """Weights of the reward."""
    conditions: Conditions = field(default_factory=Conditions)
    """What an episode may meet beyond the ordinary."""

    @cached_property
    def plants(self) -> Region | Mixture:
        """The region with the effects: what the plant of an episode is drawn from."""
        return self.region.changed(self.effects)

    @property
    def first_target(self) -> Range:
        """Range of the target at the start of an episode [bar absolute]."""
        if not isinstance(self.target_bar, MovingTarget):
            return self.target_bar
        first = float(self.target_bar.values(np.zeros(1), PRESSURE_LIMITS_BAR)[0])
        return first, first

    def __post_init__(self) -> None:
        as_scenario(self.scenario)
        if self.conditions.target_steps and isinstance(self.target_bar, MovingTarget):
            raise OptionError(
                "conditions: target_steps needs a target_bar that stays in between: give a value or "
                "(low, high), or set target_steps to 0"
            )
        assert self.plants  # refuses sizes outside their domains now, not in the first episode
        if isinstance(self.sensor_noise, bool):
            object.__setattr__(self, "sensor_noise", float(self.sensor_noise))
        check_limits(self)
        self._check_pressures()

    def _check_pressures(self) -> None:
        """A target must be reachable from below, and no episode may begin with an empty circuit."""
        target = self.first_target
        if target[1] * BAR > self.supply.pressure[0]:
            raise OptionError(
                f"target_bar up to {target[1]:g} bar exceeds the supply's least pressure, "
                f"{self.supply.pressure[0] / BAR:g} bar: lower the target or raise the supply"
            )
        first = target[0] - self.drop_bar[1] if self.p2_bar is None else self.p2_bar[0]
        if first <= EMPTY_CIRCUIT_BAR:
            raise OptionError(
                f"episodes could begin with p2 = {first:g} bar, and the circuit counts as empty at "
                f"{EMPTY_CIRCUIT_BAR:g} bar: raise target_bar or p2_bar, or lower drop_bar"
            )


READERS: dict[str, Callable[[Any], Any]] = {
    "effects": as_effects,
    "supply": as_supply,
    "scenario": as_scenario,
    "target_bar": as_target,
    "conditions": as_conditions,
}
"""Fields of Settings by what reads them from what a user writes."""

ARGUMENTS = (
    "plant", "privileged", "render_mode", "parameters", "band_bar",
    *(entry.name for entry in fields(Settings) if entry.name != "region"),
)  # fmt: skip
"""What an environment takes; see `EPValveEnv`."""


def make_settings(plant: Plant, *, others: Collection[str] = (), **options: Any) -> Settings:
    """Settings from what a user writes, an environment's arguments but the first three of ARGUMENTS.

    others: arguments that the environment takes beside ARGUMENTS. Raises OptionError for an unknown
    argument, or another ValueError for what cannot be used.
    """
    check_known("argument", options, (*ARGUMENTS, *others))
    region = as_region(options.pop("parameters", "exact"), plant)
    weights = as_weights(options.pop("weights", None), options.pop("band_bar", None))
    if options.get("supply_voltage") is None:
        options["supply_voltage"] = plant.voltage
    read = {name: READERS[name](v) if name in READERS else v for name, v in options.items()}
    return Settings(region=region, weights=weights, **read)


def checked_options(options: Any) -> dict[str, Any]:
    """The options of a reset, empty for None. Raises OptionError unless they are a mapping."""
    if not isinstance(options, (Mapping, type(None))):
        raise OptionError(f"options is {shown(options)}: give a mapping from {', '.join(OPTIONS)}")
    return dict(options or {})


def with_options(settings: Settings, options: Mapping[str, Any], plant: Plant) -> Settings:
    """The settings of one episode. Raises OptionError for an unknown key."""
    check_known("reset option", options, OPTIONS)
    others = [entry.name for entry in fields(Settings) if entry.name not in ("region", "effects")]
    unchanged = {"parameters": settings.region, **{name: getattr(settings, name) for name in others}}
    made = make_settings(plant, **{**unchanged, **options})
    return made if "effects" in options else replace(made, effects=settings.effects)
