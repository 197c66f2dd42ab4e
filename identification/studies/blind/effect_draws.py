"""How large a drawn effect is: a physically sensible part of its range (docs/effects.md).

From about a tenth of the top to the top, log-uniform: small ones show where detection ends.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Range:
    """A size in SI units, log-uniform from `low` to `high`."""

    symbol: str
    low: float
    high: float
    either_sign: bool = False

    def draw(self, rng: np.random.Generator) -> float:
        """One size [SI]."""
        size = float(np.exp(rng.uniform(np.log(self.low), np.log(self.high))))
        return -size if self.either_sign and rng.uniform() < 0.5 else size


RANGES: dict[str, tuple[tuple[Range, ...], ...]] = {
    "coil_heating": ((Range("h_coil", 0.05, 0.5),),),
    "eddy_current": ((Range("G_eddy", 8e-4, 8e-3),),),
    "flyback_voltage": ((Range("U_clamp", 0.7, 45.0),),),
    "driver_voltage_drop": ((Range("U_drop", 0.2, 2.0),),),
    "magnetic_saturation": ((Range("sMV", 8e2, 8e3),),),
    "magnetic_remanence": ((Range("I_rem", 5e-3, 5e-2),),),
    "armature_friction": ((Range("F_MV", 0.1, 1.0),),),
    "armature_bounce": ((Range("eMV", 0.08, 0.75),),),
    "armature_pressure_force": ((Range("sFMV", 0.13, 1.3),),),
    "inlet_seat_leak": ((Range("A_in", 2e-9, 2e-8),),),
    "exhaust_seat_leak": ((Range("A_exh", 2e-9, 2e-8),),),
    "control_chamber_heat": ((Range("tau_3", 4e-3, 0.4),),),
    "moving_control_volume": ((Range("sV3", 0.13, 1.3),),),
    "pressure_dependent_discharge": ((Range("kalpha", 0.04, 0.4, either_sign=True),),),
    "critical_pressure_ratio": ((Range("dbcrit", 0.03, 0.3),),),
    "piston_friction": ((Range("F_PV", 1.5, 15.0), Range("S_PV", 0.1, 1.0)),),
    "flow_force": ((Range("cflow", 0.1, 1.0),),),
    "local_gas_speed": (
        (Range("a1", 5e-3, 5e-2, either_sign=True),),
        (Range("a2", 4e-5, 4e-4),),
    ),
    "seat_leak": ((Range("A_PV", 1e-8, 2e-7),),),
    "circuit_leak": ((Range("A_circuit", 1e-8, 2e-7),),),
    "output_chamber_heat": ((Range("tau_2", 0.02, 1.0),),),
    "output_pipe": ((Range("s_pipe", 0.15, 0.8), Range("A_pipe", 8e-6, 6e-5)),),
    "supply_restriction": ((Range("z_supply", 5e3, 5e4),),),
    "pressure_sensor_lag": ((Range("tau_p2", 1e-3, 2e-2),), (Range("tau_p3", 1e-3, 2e-2),)),
    "pressure_sensor_bias": (
        (Range("b_p2", 2.5e3, 2.5e4, either_sign=True),),
        (Range("b_p3", 2.5e3, 2.5e4, either_sign=True),),
    ),
    "current_sensor_gain": ((Range("g_I", 5e-3, 0.1, either_sign=True),),),
    "command_delay": ((Range("t_delay", 3e-4, 6e-3),),),
}
"""Sizes that are drawn together, for each alternative of an effect."""

PARAMETER_OFF = (0.015, 0.05)
"""How far a parameter is off that is the cause, as a share of its table value; either sign."""

WARMEST = (1.0, 20.0)
"""How warm a winding that heats becomes over a session [K], log-uniform."""


def draw_sizes(effect: str, rng: np.random.Generator) -> dict[str, float]:
    """Sizes of an effect of the catalogue by symbol [SI]."""
    alternatives = RANGES[effect]
    chosen = alternatives[int(rng.integers(len(alternatives)))]
    return {each.symbol: each.draw(rng) for each in chosen}


def draw_parameter(value: float, rng: np.random.Generator) -> float:
    """A value that is off the table's."""
    share = rng.uniform(*PARAMETER_OFF)
    return value * (1.0 + (-share if rng.uniform() < 0.5 else share))
