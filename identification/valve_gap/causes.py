"""The catalogue of causes of a gap, with physical ranges and sizes to begin a search from."""

from collections.abc import Sequence

from epv_env.plant.effects import CATALOGUE
from epv_env.plant.parameters import table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter

COMPONENTS = {
    "coil_heating": "solenoid",
    "eddy_current": "solenoid",
    "magnetic_saturation": "solenoid",
    "flyback_voltage": "solenoid",
    "driver_voltage_drop": "solenoid",
    "magnetic_remanence": "armature",
    "armature_friction": "armature",
    "armature_bounce": "armature",
    "armature_pressure_force": "armature",
    "inlet_seat_leak": "control_chamber",
    "exhaust_seat_leak": "control_chamber",
    "control_chamber_heat": "control_chamber",
    "moving_control_volume": "control_chamber",
    "pressure_dependent_discharge": "protection_valve",
    "critical_pressure_ratio": "flow",
    "piston_friction": "protection_valve",
    "flow_force": "protection_valve",
    "local_gas_speed": "protection_valve",
    "seat_leak": "output_chamber",
    "circuit_leak": "output_chamber",
    "output_chamber_heat": "output_chamber",
    "output_pipe": "output_chamber",
    "supply_restriction": "supply",
    "pressure_sensor_lag": "sensor",
    "pressure_sensor_bias": "sensor",
    "current_sensor_gain": "sensor",
    "command_delay": "timing",
}
"""Component in which each effect lies."""

PARAMETER_COMPONENTS = {
    "cMV": "armature", "dMB": "solenoid", "mMV": "armature", "N": "solenoid", "xMV0": "armature",
    "xMVmax": "armature", "kMV": "armature", "dMVin": "control_chamber", "dMVexh": "control_chamber",
    "V3": "control_chamber", "cPV": "protection_valve", "d1": "protection_valve",
    "d2": "protection_valve", "mPV": "protection_valve", "xPV0": "protection_valve",
    "xPVmax": "protection_valve", "kPV": "protection_valve", "V2": "output_chamber",
}  # fmt: skip
"""Component of each parameter outside the four, all of Tables 6 and 7 but the cone model's."""

TRIALS = {
    "U_clamp": (0.7, 8.0, 40.0),
    "U_drop": (0.7,),
    "sMV": (4e3,),
    "I_rem": (0.015,),
    "F_MV": (0.3,),
    "eMV": (0.4, 0.8),
    "sFMV": (0.5,),
    "A_in": (4e-9,),
    "A_exh": (4e-9,),
    "sV3": (0.6,),
    "kalpha": (0.1, -0.1),
    "dbcrit": (0.1,),
    "F_PV": (4.0, 15.0),
    "cflow": (0.3,),
    "a1": (0.02, -0.02),
    "a2": (1e-4,),
    "A_PV": (2e-8,),
    "A_circuit": (2e-8,),
    "h_coil": (0.2,),
    "G_eddy": (2e-3,),
    "tau_3": (0.01, 0.1),
    "tau_2": (0.05, 0.5),
    "s_pipe": (0.4,),
    "A_pipe": (2e-5,),
    "z_supply": (2e4,),
    "tau_p2": (0.005,),
    "tau_p3": (0.005,),
    "b_p2": (5e3,),
    "b_p3": (5e3,),
    "g_I": (0.02,),
    "t_delay": (1e-3, 4e-3),
}
"""Sizes to begin a search from [SI]; a size that is not named stays off."""

LEAST = {"tau_3": 5e-4, "tau_2": 5e-4, "tau_p2": 2e-4, "tau_p3": 2e-4, "s_pipe": 0.05, "A_pipe": 2e-6}
"""Ends below which a size is not felt, or too stiff to be worth simulating."""

VARIANTS = {
    "pressure_sensor_lag": (("p2", ("tau_p2",)), ("p3", ("tau_p3",))),
    "pressure_sensor_bias": (("p2", ("b_p2",)), ("p3", ("b_p3",))),
    "piston_friction": (("", ("F_PV",)),),
    "coil_heating": (("", ("h_coil",)),),
    "local_gas_speed": (("a1", ("a1",)), ("a2", ("a2",))),
}
"""Effects that are fitted with some of their sizes at a time."""

OFF_BY = (1.03, 0.97)
"""Factors on a parameter's value to begin a search from."""

FARTHEST_OFF = 0.1
"""Share by which a parameter that is not calibrated may be off: Tables 8 and 9 vary them so far."""

PARAMETER_PRIOR = 0.5
"""Prior probability of a parameter off its table value, relative to that of an effect."""

WARM = NuisanceParameter(symbol="theta_coil", sd=25.0, step=0.1)
"""How warm the winding is when a recording begins [K]."""


def catalogue(without: Sequence[str] = ()) -> tuple[Cause, ...]:
    """All causes but those named. Raises ValueError for a name that none has."""
    every = effects() + parameters()
    unknown = set(without) - {cause.name for cause in every}
    if unknown:
        known = ", ".join(dict.fromkeys(cause.name for cause in every))
        raise ValueError(f"no cause is named {', '.join(sorted(unknown))}; known are {known}")
    return tuple(cause for cause in every if cause.name not in without)


def effects() -> list[Cause]:
    """Causes that are effects of the catalogue."""
    return [
        Cause(
            name=name,
            variant=variant,
            component=COMPONENTS[name],
            parameters=tuple(effect_size(symbol) for symbol in symbols),
            run_parameters=(WARM,) if name == "coil_heating" else (),
            prior=1.0 / len(VARIANTS.get(name, ("",))),
        )
        for name in CATALOGUE
        for variant, symbols in VARIANTS.get(name, (("", CATALOGUE[name]),))
    ]


def parameters() -> list[Cause]:
    """Causes `parameter:<symbol>`: a parameter outside the four off its table value."""
    return [
        Cause(
            name=f"parameter:{symbol}",
            component=component,
            parameters=(parameter_size(symbol),),
            prior=PARAMETER_PRIOR,
            exact_form=True,
        )
        for symbol, component in PARAMETER_COMPONENTS.items()
    ]


def effect_size(symbol: str) -> FreeParameter:
    """The size of an effect, from its row of the parameter table."""
    row = table()[symbol]
    low, high = row.domain or (0.0, 0.0)
    trials = TRIALS[symbol]
    return FreeParameter(
        symbol=symbol,
        unit=row.unit,
        low=max(low, LEAST.get(symbol, low)),
        high=high,
        trials=trials,
        scale=abs(trials[0]),
    )


def parameter_size(symbol: str) -> FreeParameter:
    """A parameter that is not off by itself; its scale is its table value."""
    row = table()[symbol]
    low, high = row.domain or (row.value, row.value)
    return FreeParameter(
        symbol=symbol,
        unit=row.unit,
        low=max(low, row.value * (1 - FARTHEST_OFF)),
        high=min(high, row.value * (1 + FARTHEST_OFF)),
        nominal=row.value,
        trials=tuple(row.value * factor for factor in OFF_BY),
        scale=row.value,
    )


def calibrated(start: dict[str, float]) -> list[FreeParameter]:
    """The four parameters that calibration fits, from `start`."""
    return [
        FreeParameter(
            symbol=symbol,
            unit=table()[symbol].unit,
            low=min(table()[symbol].domain or (0.0,)),
            high=max(table()[symbol].domain or (0.0,)),
            nominal=start[symbol],
            scale=start[symbol],
        )
        for symbol in CALIBRATED_SYMBOLS
    ]
