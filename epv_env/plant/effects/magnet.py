"""Effects of the iron: saturation and remanence."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import QUARTER_PI, inlined


@inlined
def steepness(u, knee):
    """Reciprocal of the differential inductance relative to that of linear iron [-].

    u: level of saturation. knee: w_sat. (1 + u)^2 is that of the Froelich-Kennelly curve, of which
    iron that is saturated throughout leaves an eighth.
    """
    curve = (1.0 + u) * (1.0 + u)
    beyond, most = 1.0 + 16.0 * u * u * u * u, 8.0 * curve
    beyond = most + (beyond < most) * (beyond - most)  # the smaller one, of arrays and in C, too
    return curve + knee * (beyond - curve)


def inverse_inductance(p: Mapping[str, NDArray]) -> NDArray:
    """Greatest reciprocal of the coil's differential inductance [1/H], shape as the parameters."""
    reluctance = p["RML"] + p["xMVmax"] / (p["mu0"] * QUARTER_PI * p["dMB"] ** 2)
    level = p["sMV"] * p["N"] / p["RML"]  # at 1 A, the end of Table 1's range
    return reluctance / p["N"] ** 2 * np.maximum(steepness(level, p["w_sat"]), 1.0)


MAGNETIC_SATURATION = Effect(
    name="magnetic_saturation",
    component="solenoid",
    strength=("saturation",),
    form=(
        "Φ = N I/(Rm + N I sMV); force from its coenergy, N² I²/(Rm² μ0 A) (ln(1+u) − u/(1+u))/u², "
        "u = sMV N I/Rm; 1/L = Rm/N² ((1 − w_sat)(1+u)² + w_sat min(1 + 16 u⁴, 8 (1+u)²))"
    ),
    source="Fröhlich 1881, Kennelly 1891; iron saturates at 1.6–2 T, that is 1.3–1.6·10⁻⁴ V s over A_MB",
    sizes=(
        Size(
            symbol="sMV",
            unit="1/(V s)",
            domain=(0, 20000.0),
            meaning="inverse of the flux at which the iron saturates",
            trials=(4e3,),
            drawn=(8e2, 8e3),
        ),
        Size(
            symbol="w_sat",
            unit="1",
            domain=(0, 1.5),
            meaning="how far the inductance falls beyond a knee instead of by the curve",
            spread=1.0,
        ),
    ),
    constants=(
        # turns over the saturation flux: with I/Rm, how far the iron saturates [1/(V s)]
        Constant("saturation", lambda p: p["sMV"] * p["N"]),
        # how sharply the inductance bends [-]
        Constant("saturation_knee", lambda p: p["w_sat"], is_size=False),
    ),
    fastest_rate=lambda p: p["R"] * inverse_inductance(p),
)

MAGNETIC_REMANENCE = Effect(
    name="magnetic_remanence",
    component="armature",
    strength=("I_rem",),
    form="flux and force act as with I + I_rem",
    source="coercive field of soft solenoid steel, 50–200 A/m over a few cm of iron",
    sizes=(
        Size(
            symbol="I_rem",
            constant="I_rem",
            unit="A",
            domain=(0, 0.1),
            meaning="current that would make the iron's residual flux",
            trials=(0.015,),
            drawn=(5e-3, 5e-2),
        ),
    ),
)


@inlined
def saturation_level(current, inverse_Rm, saturation):
    """u of the Froelich-Kennelly curve: flux = N I / (Rm (1 + u)) [-]; 0 for iron that is linear."""
    return saturation * abs(current) * inverse_Rm


@inlined
def saturated_force(u):
    """Magnetic force relative to N^2 I^2/(Rm^2 mu0 A): 1/2 for linear iron [-].

    From the coenergy of the Froelich-Kennelly curve: (ln(1 + u) - u/(1 + u))/u^2, with the logarithm
    as the series 2 artanh(w), w = u/(2 + u): without cancellation at u = 0, within 1e-5 up to u = 3.
    """
    w = u / (2.0 + u)
    s = w * w
    series = s * (1 / 5 + s * (1 / 7 + s * (1 / 9 + s * (1 / 11 + s * (1 / 13 + s * (1 / 15))))))
    return 0.5 * (1.0 - w) * (1.0 - w) * (1.0 / (1.0 + w) + w * (1 / 3 + series))
