"""Effects on flows: discharge, choking, jet force, the cone model, the supply's pipe."""

import math

import numpy as np
from numpy.polynomial import Polynomial, chebyshev

from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import CRITICAL_RATIO, KAPPA, inlined

FILLING_TIME = 0.5e-3
"""Time constant with which the pressure before the valve follows the flow through its pipe [s]."""

PRESSURE_DEPENDENT_DISCHARGE = Effect(
    name="pressure_dependent_discharge",
    component="protection_valve",
    strength=("discharge_slope",),
    form="alphaPV (1 + k (1 − p2/p1))",
    source="Perry 1949: sharp edges discharge 0.6 at small drops, 0.85 choked",
    sizes=(
        Size(
            symbol="kalpha",
            constant="discharge_slope",
            unit="1",
            domain=(-0.5, 0.5),
            meaning="relative rise of alphaPV from p2 = p1 to p2 = 0",
            trials=(0.1, -0.1),
            drawn=(0.04, 0.4),
            either_sign=True,
        ),
    ),
)

CRITICAL_PRESSURE_RATIO = Effect(
    name="critical_pressure_ratio",
    component="flow",
    strength=("drop_deficit",),
    form=(
        "all orifices (but that of the output pipe) choke at b = 0.528 − d: the drop 1 − r counts by "
        "(1 − 0.528)/(1 − b)"
    ),
    source="ISO 6358-1: b of 0.1–0.5 for real valves; within 3 % of its ellipse",
    sizes=(
        Size(
            symbol="dbcrit",
            unit="1",
            domain=(0, 0.4),
            meaning="how far the orifices' critical pressure ratio lies below 0.528",
            trials=(0.1,),
            drawn=(0.03, 0.3),
        ),
    ),
    constants=(
        # 1 less the share of the pressure drop that counts towards choking [-]
        Constant("drop_deficit", lambda p: p["dbcrit"] / (1 - CRITICAL_RATIO + p["dbcrit"])),
    ),
)

FLOW_FORCE = Effect(
    name="flow_force",
    component="protection_valve",
    strength=("flow_force",),
    form="− c A_eff (p1 − p2), A_eff the seat's effective opening",
    source="Merritt 1967: 2 cos 69° = 0.72",
    sizes=(
        Size(
            symbol="cflow",
            constant="flow_force",
            unit="1",
            domain=(0, 1.5),
            meaning="force of the PV jet per area and pressure drop",
            trials=(0.3,),
            drawn=(0.1, 1.0),
        ),
    ),
)

LOCAL_GAS_SPEED = Effect(
    name="local_gas_speed",
    component="protection_valve",
    strength=("a1", "a2"),
    form="the cone model of eqs 9 and 15: de = d2 − 2 xPV (a1 + a2 w)",
    source="the report",
    sizes=(
        Size(
            symbol="a1",
            constant="a1",
            trials=(0.02, -0.02),
            drawn=(5e-3, 5e-2),
            either_sign=True,
        ),
        Size(
            symbol="a2",
            constant="a2",
            trials=(1e-4,),
            drawn=(4e-5, 4e-4),
        ),
    ),
    alternatives={"a1": ("a1",), "a2": ("a2",)},
    constants=(
        # R T of the supply air, which turns a pressure ratio into a gas speed [J/kg]
        Constant("RT", lambda p: p["R_gas"] * p["T_env"], is_size=False),
    ),
)

SUPPLY_RESTRICTION = Effect(
    name="supply_restriction",
    component="supply",
    strength=("supply_loss",),
    form="the valve sees p1 less (z w)²/(2 ρ), ρ at what it sees, reached in 0.5 ms; z = √ζ/A",
    source=(
        "ζ w²/(2 ρ A²), loss coefficients of pipes and fittings; the 0.5 ms only decouples flow "
        "and pressure"
    ),
    sizes=(
        Size(
            symbol="z_supply",
            unit="1/m^2",
            domain=(0, 100000.0),
            meaning="reciprocal of the effective area of the input pipe",
            trials=(2e4,),
            drawn=(5e3, 5e4),
        ),
        Size(
            symbol="wPV_supply",
            unit="1",
            domain=(-1, 1),
            meaning="how much more than assumed the PV lies behind the restriction; -1: not at all",
            spread=0.5,
        ),
        Size(
            symbol="wMV_supply",
            unit="1",
            domain=(-1, 1),
            meaning="the same for the MV",
            spread=0.5,
        ),
    ),
    constants=(
        # pressure lost before the valve, times p1 over the flow squared [Pa^2 s^2/kg^2]
        Constant("supply_loss", lambda p: 0.5 * (p["R_gas"] * p["T_env"]) * p["z_supply"] ** 2),
        # share of that pressure that the PV feels, and of its flow that loses it [-]
        Constant("supply_PV", lambda p: 1 + p["wPV_supply"], is_size=False),
        # the same for the MV [-]
        Constant("supply_MV", lambda p: 1 + p["wMV_supply"], is_size=False),
    ),
    fastest_rate=lambda p: np.where(np.asarray(p["z_supply"]) > 0, 1 / FILLING_TIME, 0.0),
)


def heat_drop_over_drop(u: np.ndarray) -> np.ndarray:
    """2k/(k-1) (1 - r^((k-1)/k)) / u for u = 1 - r^(1/4) > 0, exactly [-]."""
    return 2 * KAPPA / (KAPPA - 1) * (1 - (1 - np.asarray(u)) ** (4 * (KAPPA - 1) / KAPPA)) / u


def _fit() -> tuple[float, ...]:
    """Chebyshev interpolation of `heat_drop_over_drop`, as plain powers.

    `gas_speed` is within 2e-9 down to a fourth root of the pressure ratio of 0.5; below it errs by more.
    """
    nodes = (chebyshev.chebpts1(8) + 1) / 2 * (1 - 0.5)
    return tuple(Polynomial.fit(nodes, heat_drop_over_drop(nodes), 7).convert().coef.tolist())


_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7 = _fit()


@inlined
def gas_speed(p1, p2, RT):
    """Speed to which gas at rest at p1 expands without loss down to p2 [m/s].

    sqrt(2k/(k-1) RT (1 - r^((k-1)/k))), r = p2/p1. A polynomial in 1 - r^(1/4) replaces the power, which
    vector instructions lack: it would take as long as all other effects together.
    """
    u = 1.0 - math.sqrt(math.sqrt(min(p2 / p1, 1.0)))
    bracket = _C0 + u * (_C1 + u * (_C2 + u * (_C3 + u * (_C4 + u * (_C5 + u * (_C6 + u * _C7))))))
    return math.sqrt(RT * u * bracket)


@inlined
def effective_seat_diameter(xPV, p1, p2, d2, effects):
    """Diameter on which p2 acts when the jet leaves the seat as a cone [m] (eqs 9, 15).

    de = d2 - 2 xPV zeta, zeta = a1 + a2 w, with w the isentropic gas speed from p1 to p2 [m/s].
    """
    zeta = effects.a1 + effects.a2 * gas_speed(p1, p2, effects.RT)
    return d2 - 2.0 * xPV * zeta


@inlined
def discharge(p1, p2, effects):
    """alphaPV relative to its value without a pressure drop [-] (Perry 1949: it rises with the drop)."""
    return 1.0 + effects.discharge_slope * (1.0 - min(p2 / p1, 1.0))


@inlined
def supply_drop_rate(flow, p1, drop, effects):
    """Rate of the pressure lost before the valve [Pa/s]; it follows zeta flow^2/(2 rho A^2)."""
    steady = min(effects.supply_loss * flow * flow / p1, 0.5 * p1)
    return (steady - drop) * (1.0 / FILLING_TIME)
