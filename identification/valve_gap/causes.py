"""The catalogue of causes of a gap, with physical ranges and sizes to begin a search from."""

import math
from collections.abc import Collection, Sequence

from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.gap.plant import Cause, FreeParameter, NuisanceParameter

PARAMETER_RANGE = 0.1
"""Share by which a parameter that is not calibrated may be off [-]: Tables 8 and 9 vary them so far."""

PARAMETER_TRIALS = (1.03, 0.97)
"""Factors on such a parameter's value from which its fit begins [-]."""

PARAMETER_PRIOR = 0.5
"""Prior probability that a parameter is off, relative to that of an effect [-]."""

PARAMETER_COMPONENTS = {
    "cMV": "armature", "dMB": "solenoid", "mMV": "armature", "N": "solenoid", "xMV0": "armature",
    "xMVmax": "armature", "kMV": "armature", "dMVin": "control_chamber", "dMVexh": "control_chamber",
    "V3": "control_chamber", "cPV": "protection_valve", "d1": "protection_valve",
    "d2": "protection_valve", "mPV": "protection_valve", "xPV0": "protection_valve",
    "xPVmax": "protection_valve", "kPV": "protection_valve", "V2": "output_chamber",
}  # fmt: skip
"""Component of each parameter outside the four, all of Tables 6 and 7 but the cone model's."""


WORDS = {
    "coil_heating": "heating of the coil",
    "eddy_current": "eddy current in the solenoid's iron",
    "flyback_voltage": "diode or clamp at the coil",
    "driver_voltage_drop": "voltage drop in the coil's driver",
    "magnetic_saturation": "saturation of the solenoid's iron",
    "magnetic_remanence": "residual magnetism of the solenoid's iron",
    "armature_friction": "friction of the armature",
    "armature_bounce": "bouncing of the armature",
    "armature_pressure_force": "pressure force on the armature",
    "inlet_seat_leak": "leak of the solenoid valve's inlet seat",
    "exhaust_seat_leak": "leak of the solenoid valve's exhaust seat",
    "control_chamber_heat": "heat exchange in the control chamber",
    "moving_control_volume": "piston's sweep of the control chamber",
    "pressure_dependent_discharge": "discharge coefficient that depends on pressure",
    "critical_pressure_ratio": "lower critical pressure ratio of the orifices",
    "piston_friction": "friction of the piston's seals",
    "flow_force": "flow force on the piston",
    "local_gas_speed": "jet angle that depends on the gas speed",
    "seat_leak": "leak of the protection valve's seat",
    "circuit_leak": "leak of the circuit to ambient",
    "output_chamber_heat": "heat exchange in the output chamber",
    "output_pipe": "pipe in the output circuit",
    "supply_restriction": "restriction in the supply line",
    "pressure_sensor_lag": "lag of a pressure sensor",
    "pressure_sensor_bias": "offset of a pressure sensor",
    "pressure_sensor_gain": "scale error of a pressure sensor",
    "current_sensor_gain": "scale error of the current sensor",
    "command_delay": "delay of the command",
}
"""What people read beside an effect's name; an effect that is not here is called by its name alone."""


def catalogue(
    nominal: Parameters,
    without: Sequence[str] = (),
    free: Collection[str] = CALIBRATED_SYMBOLS,
) -> tuple[Cause, ...]:
    """All causes but those named; without those parameters that calibration fits anyway.

    nominal: parameters of the model. free: symbols that calibration fits. Raises ValueError for a name
    that no cause has.
    """
    every = effects() + [c for c in parameters(nominal) if c.parameters[0].symbol not in free]
    unknown = set(without) - {cause.name for cause in every}
    if unknown:
        known = ", ".join(dict.fromkeys(cause.name for cause in every))
        raise ValueError(f"no cause is named {', '.join(sorted(unknown))}; known are {known}")
    return tuple(cause for cause in every if cause.name not in without)


def effects() -> list[Cause]:
    """Causes that are effects of the catalogue, a variant each."""
    return [
        Cause(
            name=effect.name,
            words=WORDS.get(effect.name, ""),
            variant=variant,
            component=effect.component,
            parameters=tuple(effect_size(size) for size in sizes),
            run_parameters=tuple(
                NuisanceParameter(symbol=size.symbol, sd=size.scatter, step=size.difference or 0.0)
                for size in effect.sizes
                if size.scatter
            ),
            prior=1.0 / len(effect.fitted),
            exact_form=not effect.strength,
        )
        for effect in EFFECTS
        for variant, sizes in effect.fitted.items()
    ]


def parameters(nominal: Parameters) -> list[Cause]:
    """Causes `parameter:<symbol>`: a parameter outside the four off its nominal value."""
    return [
        Cause(
            name=f"parameter:{symbol}",
            words=f"different {table()[symbol].meaning}",
            component=component,
            parameters=(parameter_size(symbol, nominal),),
            prior=PARAMETER_PRIOR,
            exact_form=True,
        )
        for symbol, component in PARAMETER_COMPONENTS.items()
    ]


def effect_size(size: Size) -> FreeParameter:
    """A size of an effect as the diagnosis fits it."""
    row = table()[size.symbol]
    low, high = row.domain or (0.0, 0.0)
    return FreeParameter(
        symbol=size.symbol,
        meaning=row.meaning,
        unit=row.unit,
        low=max(low, low if size.least_fitted is None else size.least_fitted),
        high=high,
        trials=size.trials,
        scale=abs(size.trials[0]) if size.trials else 1.0,
        sd=size.spread or math.inf,
    )


def parameter_size(symbol: str, nominal: Parameters) -> FreeParameter:
    """A parameter that is not off by itself; its scale is its nominal value."""
    value, (low, high) = nominal[symbol], nominal.domain(symbol)
    return FreeParameter(
        symbol=symbol,
        meaning=table()[symbol].meaning,
        unit=table()[symbol].unit,
        low=max(low, value * (1 - PARAMETER_RANGE)),
        high=min(high, value * (1 + PARAMETER_RANGE)),
        nominal=value,
        trials=tuple(value * factor for factor in PARAMETER_TRIALS),
        scale=value,
    )
