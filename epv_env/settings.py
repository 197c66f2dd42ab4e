"""What configures an environment: at construction, and per episode through reset(options=...)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from epv_env.common.units import BAR
from epv_env.plant.consumption import MIXED, Scenario, check_scenario
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from epv_env.plant.supply import Supply
from epv_env.reward import RewardWeights

Range = tuple[float, float]
"""Least and greatest value."""

PRESSURE_LIMITS_BAR = (1.0, 16.0)
"""Range of the pressure sensors (Table 1), bar absolute."""

EMPTY_CIRCUIT_BAR = 1.5
"""Circuit pressure at which an episode fails: the consumers could no longer draw their flow."""

OPTIONS = ("parameters", "scenario", "supply", "target_bar", "p2_bar", "p3_bar")
"""Keys that reset(options=...) understands, beside Gymnasium's "reset_mask"."""


class OptionError(ValueError):
    """An environment option is unknown or out of range: the message says which and the remedy."""


def as_range(name: str, value: Any, limits: Range = PRESSURE_LIMITS_BAR) -> Range:
    """A number or (low, high) as a range inside the limits. Raises OptionError."""
    try:
        low, high = (float(end) for end in (value if np.ndim(value) else (value, value)))
    except (TypeError, ValueError):
        raise OptionError(f"{name} is {value!r}: give a number or (low, high)") from None
    if not limits[0] <= low <= high <= limits[1]:
        raise OptionError(
            f"{name} = [{low:g}, {high:g}] must satisfy {limits[0]:g} <= low <= high <= {limits[1]:g}"
        )
    return low, high


def as_region(value: Any, plant: Plant) -> Region:
    """A region from its name, from values and ranges by symbol, from Parameters or a Region."""
    if isinstance(value, Region):
        return value
    if isinstance(value, Parameters):
        return Region(centre=value)
    if isinstance(value, Mapping):
        return Region.from_choices(value, plant.parameters)
    if value == "confidence":
        if not plant.region.varies:
            raise OptionError(
                f"plant {plant.name!r} has no confidence region: give ranges by symbol, or a plant "
                "file from identification"
            )
        return plant.region
    return Region.named(value, plant.parameters)


def as_supply(value: Any) -> Supply:
    """A Supply, from itself, a constant pressure or range [bar absolute], or None (reservoirs)."""
    if value is None:
        return Supply.reservoirs()
    if isinstance(value, Supply):
        return value
    return Supply.constant(*as_range("supply", value))


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Everything that defines the task; units in the names, ranges drawn uniformly per episode."""

    region: Region
    """Region from which the plant's parameters are drawn."""
    control_period: float
    """Time between decisions [s]."""
    supply: Supply = field(default_factory=Supply.reservoirs)
    """Supply of the input chamber."""
    scenario: str | Scenario = MIXED
    """Consumption: a name, or a scenario of one's own."""
    target_bar: Range = (6.0, 9.5)
    """Target pressure [bar absolute]."""
    p2_bar: Range | None = None
    """First circuit pressure; None: `drop_bar` below the target (an excess could not be undone)."""
    p3_bar: Range | None = None
    """First control pressure; None: p1, the energised steady state."""
    drop_bar: Range = (0.0, 2.0)
    """How far the first circuit pressure lies below the target [bar]."""
    supply_voltage: float = 24.0
    """Solenoid voltage when on [V]."""
    settling_time: float = 0.5
    """Time after which the band of C1 has to hold [s]."""
    sensor_noise: float = 1.0
    """Standard deviations of the sensors' noise relative to Table 3's; True is 1, False is 0."""
    weights: RewardWeights = field(default_factory=RewardWeights)
    """Weights of the reward."""

    def __post_init__(self) -> None:
        check_scenario(self.scenario)
        if not 0.5e-3 <= self.control_period <= 0.1:
            raise OptionError(
                f"control_period = {self.control_period:g} s must lie between 0.5 ms and 100 ms"
            )
        if not 0 <= self.settling_time < np.inf:
            raise OptionError(f"settling_time = {self.settling_time!r} s must be at least 0")
        if not 0 <= self.sensor_noise < np.inf:
            raise OptionError(f"sensor_noise = {self.sensor_noise!r} must be at least 0: 1 is Table 3's")
        if not isinstance(self.weights, RewardWeights):
            raise OptionError(f"weights is {self.weights!r}: give a RewardWeights")
        self._check_pressures()

    def _check_pressures(self) -> None:
        """A target must be reachable from below, and no episode may begin with an empty circuit."""
        if self.target_bar[1] * BAR > self.supply.pressure[0]:
            raise OptionError(
                f"target_bar up to {self.target_bar[1]:g} bar exceeds the supply's least pressure, "
                f"{self.supply.pressure[0] / BAR:g} bar: lower the target or raise the supply"
            )
        first = self.target_bar[0] - self.drop_bar[1] if self.p2_bar is None else self.p2_bar[0]
        if first <= EMPTY_CIRCUIT_BAR:
            raise OptionError(
                f"episodes could begin with p2 = {first:g} bar, and the circuit counts as empty at "
                f"{EMPTY_CIRCUIT_BAR:g} bar: raise target_bar or p2_bar, or lower drop_bar"
            )
        if not 0 < self.supply_voltage <= 32:
            raise OptionError(
                f"supply_voltage = {self.supply_voltage:g} V must lie in (0, 32] (Table 1)"
            )


def make_settings(
    plant: Plant,
    *,
    parameters: Any = "exact",
    supply: Any = None,
    target_bar: Any = (6.0, 9.5),
    p2_bar: Any = None,
    p3_bar: Any = None,
    drop_bar: Any = (0.0, 2.0),
    **rest: Any,
) -> Settings:
    """Settings from what a user writes; see `EPValveEnv` for the arguments."""
    return Settings(
        region=as_region(parameters, plant),
        supply=as_supply(supply),
        target_bar=as_range("target_bar", target_bar),
        p2_bar=None if p2_bar is None else as_range("p2_bar", p2_bar),
        p3_bar=None if p3_bar is None else as_range("p3_bar", p3_bar),
        drop_bar=as_range("drop_bar", drop_bar, (0.0, 16.0)),
        **rest,
    )


def with_options(settings: Settings, options: Mapping[str, Any], plant: Plant) -> Settings:
    """The settings of one episode. Raises OptionError for an unknown key."""
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise OptionError(
            f"unknown reset option {', '.join(map(repr, unknown))}: known are {', '.join(OPTIONS)}"
        )
    chosen = {name: options.get(name, getattr(settings, name)) for name in OPTIONS[1:]}
    return make_settings(
        plant,
        parameters=options.get("parameters", settings.region),
        control_period=settings.control_period,
        drop_bar=settings.drop_bar,
        supply_voltage=settings.supply_voltage,
        settling_time=settings.settling_time,
        sensor_noise=settings.sensor_noise,
        weights=settings.weights,
        **chosen,
    )
