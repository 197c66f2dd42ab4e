"""What configures an environment: at construction, and per episode through reset(options=...)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from epv_env.arguments import (
    PRESSURE_LIMITS_BAR,
    OptionError,
    Range,
    as_effects,
    as_range,
    as_region,
    as_scenario,
    as_supply,
    as_target,
    as_weights,
)
from epv_env.common.units import BAR
from epv_env.conditions import Conditions, as_conditions
from epv_env.plant.consumption import MIXED, Scenario
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from epv_env.plant.supply import Supply
from epv_env.reward import RewardWeights
from epv_env.signals import MovingTarget, RecordedConsumption

EMPTY_CIRCUIT_BAR = 1.5
"""Circuit pressure at which an episode fails: the consumers could no longer draw their flow."""

MOST_NOISE = 1000.0
"""Factor of the sensors' noise, at most: beyond, every reading is at an end of its range."""

OPTIONS = ("parameters", "effects", "scenario", "supply", "target_bar", "p2_bar", "p3_bar", "conditions")
"""Keys that reset(options=...) understands, beside Gymnasium's "reset_mask"."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Everything that defines the task; units in the names, ranges drawn uniformly per episode."""

    region: Region
    """Region from which the plant's parameters are drawn, but the sizes of `effects`."""
    effects: Mapping[str, Any] = field(default_factory=dict)
    """Sizes of effects by symbol, a number or (low, high) [SI]; the others are the region's."""
    control_period: float
    """Time between decisions [s]."""
    supply: Supply = field(default_factory=Supply.reservoirs)
    """Supply of the input chamber."""
    scenario: str | Scenario | RecordedConsumption = MIXED
    """Consumption: a name, a scenario of one's own, or a recording."""
    target_bar: Range | MovingTarget = (6.0, 9.5)
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
    conditions: Conditions = field(default_factory=Conditions)
    """What an episode may meet beyond the ordinary."""

    @cached_property
    def plants(self) -> Region:
        """The region with the effects: what the plant of an episode is drawn from."""
        own = Region.from_choices(self.effects, self.region.centre)
        return replace(self.region, centre=own.centre, boxes={**self.region.boxes, **own.boxes})

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
        for name in ("control_period", "settling_time", "sensor_noise", "supply_voltage"):
            value = getattr(self, name)
            if isinstance(value, str) or not np.isscalar(value):
                raise OptionError(f"{name} is {value!r}: give a number")
        if not 0.5e-3 <= self.control_period <= 0.1:
            raise OptionError(
                f"control_period = {self.control_period:g} s must lie between 0.5 ms and 100 ms"
            )
        if not 0 <= self.settling_time < np.inf:
            raise OptionError(f"settling_time = {self.settling_time!r} s must be at least 0")
        if not 0 <= self.sensor_noise <= MOST_NOISE:
            raise OptionError(
                f"sensor_noise = {self.sensor_noise!r} must lie in 0 to {MOST_NOISE:g}: 1 is Table 3's"
            )
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
        if not 0 < self.supply_voltage <= 32:
            raise OptionError(
                f"supply_voltage = {self.supply_voltage:g} V must lie in (0, 32] (Table 1)"
            )


def make_settings(
    plant: Plant,
    *,
    parameters: Any = "exact",
    effects: Any = None,
    scenario: Any = MIXED,
    supply: Any = None,
    weights: Any = None,
    band_bar: float | None = None,
    target_bar: Any = (6.0, 9.5),
    p2_bar: Any = None,
    p3_bar: Any = None,
    drop_bar: Any = (0.0, 2.0),
    conditions: Any = None,
    supply_voltage: float | None = None,
    **rest: Any,
) -> Settings:
    """Settings from what a user writes; see `EPValveEnv` for the arguments."""
    return Settings(
        region=as_region(parameters, plant),
        effects=as_effects(effects or {}),
        scenario=as_scenario(scenario),
        supply=as_supply(supply),
        weights=as_weights(RewardWeights() if weights is None else weights, band_bar),
        target_bar=as_target(target_bar),
        p2_bar=None if p2_bar is None else as_range("p2_bar", p2_bar),
        p3_bar=None if p3_bar is None else as_range("p3_bar", p3_bar),
        drop_bar=as_range("drop_bar", drop_bar, (0.0, 16.0)),
        conditions=as_conditions(conditions),
        supply_voltage=plant.voltage if supply_voltage is None else supply_voltage,
        **rest,
    )


def with_options(settings: Settings, options: Mapping[str, Any], plant: Plant) -> Settings:
    """The settings of one episode. Raises OptionError for an unknown key."""
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise OptionError(
            f"unknown reset option {', '.join(map(repr, unknown))}: known are {', '.join(OPTIONS)}"
        )
    chosen = {name: options.get(name, getattr(settings, name)) for name in OPTIONS[2:]}
    made = make_settings(
        plant,
        parameters=options.get("parameters", settings.region),
        effects=options.get("effects"),
        control_period=settings.control_period,
        drop_bar=settings.drop_bar,
        supply_voltage=settings.supply_voltage,
        settling_time=settings.settling_time,
        sensor_noise=settings.sensor_noise,
        weights=settings.weights,
        **chosen,
    )
    return made if "effects" in options else replace(made, effects=settings.effects)
