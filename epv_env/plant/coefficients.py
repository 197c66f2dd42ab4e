"""From parameters by symbol to the coefficients that the equations use."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.effects import CLAMP_WIDTH, SLIDING_SPEED_MV, SLIDING_SPEED_PV, Effects
from epv_env.plant.equations import Coefficients
from epv_env.plant.flow import CRITICAL_RATIO

QUARTER_PI = np.pi / 4

GREATEST_CURRENT = 1.0
"""Up to which saturation is followed [A] (Table 1's range)."""

STABLE = 1.0
"""Longest step times fastest rate at which the integrator follows an effect well [-]."""

UNLIMITED = 1.0
"""Longest step where no effect asks for a shorter one [s]."""


def coefficients(p: Mapping[str, ArrayLike], reservoir_volume: ArrayLike = np.inf) -> NDArray:
    """Table [row of Coefficients, valve] for one valve (scalars) or n valves (arrays of shape (n,)).

    reservoir_volume: V1 [m^3]; infinite for a supply that does not sag.
    """
    p = {symbol: np.asarray(value, dtype=float) for symbol, value in p.items()}
    RT = p["R_gas"] * p["T_env"]
    rows = Coefficients(
        cPV=p["cPV"],
        xPV0=p["xPV0"],
        kPV=p["kPV"],
        xPVmax=p["xPVmax"],
        ePV=p["ePV"],
        piston_area=QUARTER_PI * p["d1"] ** 2,
        seat_diameter=p["d2"],
        mPV_inverse=1 / p["mPV"],
        curtain_PV=p["alphaPV"] * np.pi * p["d2"],
        cMV=p["cMV"],
        xMV0=p["xMV0"],
        kMV=p["kMV"],
        xMVmax=p["xMVmax"],
        eMV=p["eMV"],
        mMV_inverse=1 / p["mMV"],
        curtain_in=p["alphaMV"] * np.pi * p["dMVin"],
        orifice_in=p["alphaMV"] * QUARTER_PI * p["dMVin"] ** 2,
        curtain_exh=p["alphaMV"] * np.pi * p["dMVexh"],
        orifice_exh=p["alphaMV"] * QUARTER_PI * p["dMVexh"] ** 2,
        kink_in=p["dMVin"] / 4,
        kink_exh=p["xMVmax"] - p["dMVexh"] / 4,
        R=p["R"],
        RML=p["RML"],
        gap_reluctance=1 / (p["mu0"] * QUARTER_PI * p["dMB"] ** 2),
        N_squared=p["N"] ** 2,
        N_squared_inverse=1 / p["N"] ** 2,
        RT_V2=RT / p["V2"],
        RT_V3=RT / p["V3"],
        RT_V1=RT / np.asarray(reservoir_volume, dtype=float),
        inverse_sqrt_RT=1 / np.sqrt(RT),
        p_env=p["p_env"],
    )
    return np.ascontiguousarray(np.broadcast_arrays(*np.atleast_1d(*rows)), dtype=float)


def effect_sizes(p: Mapping[str, ArrayLike]) -> NDArray:
    """Table [row of Effects, valve] in the same shape."""
    p = {symbol: np.asarray(value, dtype=float) for symbol, value in p.items()}
    friction_rate = np.maximum(
        p["F_MV"] / (p["mMV"] * SLIDING_SPEED_MV), p["F_PV"] / (p["mPV"] * SLIDING_SPEED_PV)
    )
    reluctance = p["RML"] + p["xMVmax"] / (p["mu0"] * QUARTER_PI * p["dMB"] ** 2)
    flattened = (1 + p["sMV"] * p["N"] * GREATEST_CURRENT / p["RML"]) ** 2
    per_inductance = reluctance / p["N"] ** 2 * flattened
    clamp_rate = p["U_clamp"] / CLAMP_WIDTH * per_inductance
    rows = Effects(
        a1=p["a1"],
        a2=p["a2"],
        RT=p["R_gas"] * p["T_env"],
        U_drop=p["U_drop"],
        U_clamp=p["U_clamp"],
        saturation=p["sMV"] * p["N"],
        I_rem=p["I_rem"],
        friction_MV=p["F_MV"],
        inlet_area=p["sFMV"] * QUARTER_PI * p["dMVin"] ** 2,
        exhaust_area=p["sFMV"] * QUARTER_PI * p["dMVexh"] ** 2,
        leak_inlet=p["A_in"],
        leak_exhaust=p["A_exh"],
        swept=p["sV3"] * QUARTER_PI * p["d1"] ** 2 / p["V3"],
        discharge_slope=p["kalpha"],
        drop_deficit=p["dbcrit"] / (1 - CRITICAL_RATIO + p["dbcrit"]),
        flow_force=p["cflow"],
        friction_PV=p["F_PV"],
        leak_PV=p["A_PV"],
        leak_circuit=p["A_circuit"],
        steady_step=STABLE / np.maximum(friction_rate, p["R"] * per_inductance),
        clamp_step=STABLE / np.maximum(clamp_rate, STABLE / UNLIMITED),
    )
    return np.ascontiguousarray(np.broadcast_arrays(*np.atleast_1d(*rows)), dtype=float)


def has_effects(effects: NDArray) -> NDArray:
    """Which valves have an effect switched on, boolean (valve,); RT and the steps are not sizes."""
    sizes = Effects(*effects)
    properties = ("RT", "steady_step", "clamp_step")
    return np.any([getattr(sizes, f) != 0 for f in Effects._fields if f not in properties], axis=0)
