"""From parameters by symbol to the coefficients that the equations use."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.effects import (
    CLAMP_WIDTH,
    FILLING_TIME,
    SLIDING_SPEED_MV,
    SLIDING_SPEED_PV,
    Effects,
)
from epv_env.plant.equations import Coefficients
from epv_env.plant.flow import CRITICAL_RATIO, LAMINAR_DROP

QUARTER_PI = np.pi / 4

GREATEST_CURRENT = 1.0
"""Up to which saturation is followed [A] (Table 1's range)."""

STABLE = 1.0
"""Longest step times fastest rate at which the integrator follows an effect well [-]."""

FRICTION_STABLE = 0.7
"""The same for friction near rest, where its rate falls steeply with speed [-]."""

SHORTEST_TIME = 1e-4
"""Time constant below which nothing is felt of a lag or of heat in a chamber, and neither acts [s]."""

SMALLEST_SHARE = 0.01
"""Share of V2 behind its pipe below which no pipe acts [-]."""

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
    RT = p["R_gas"] * p["T_env"]
    friction_rate_PV = p["F_PV"] * (1 + p["S_PV"]) / (p["mPV"] * SLIDING_SPEED_PV)
    friction_rate_MV = p["F_MV"] / (p["mMV"] * SLIDING_SPEED_MV)
    reluctance = p["RML"] + p["xMVmax"] / (p["mu0"] * QUARTER_PI * p["dMB"] ** 2)
    flattened = (1 + p["sMV"] * p["N"] * GREATEST_CURRENT / p["RML"]) ** 2
    per_inductance = reluctance / p["N"] ** 2 * flattened
    clamp_rate = p["U_clamp"] / CLAMP_WIDTH * per_inductance
    share = np.where(p["s_pipe"] < SMALLEST_SHARE, 0.0, p["s_pipe"])
    piped = (share > 0).astype(float)
    per_far_share = piped / np.where(share > 0, share, 1.0)
    near_share = 1 / (1 - share)
    # An orifice's flow rises steepest within its laminar region, where the bracket of flow.py is 2.
    steepest = np.sqrt(2 * RT / LAMINAR_DROP)
    pipe_rate = piped * p["A_pipe"] * steepest / p["V2"] * (per_far_share + near_share)
    rates = {name: _rate(p[name]) for name in ("tau_3", "tau_2", "tau_p2", "tau_p3")}
    fastest = np.full_like(pipe_rate, 1 / FILLING_TIME)
    for rate in (p["R"] * per_inductance, pipe_rate, *rates.values()):
        fastest = np.maximum(fastest, rate)
    rows = Effects(
        a1=p["a1"],
        a2=p["a2"],
        RT=RT,
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
        breakaway_PV=p["S_PV"],
        leak_PV=p["A_PV"],
        leak_circuit=p["A_circuit"],
        eddy=p["G_eddy"],
        heating=p["h_coil"],
        coil_start=p["theta_coil"],
        warm_3=np.sign(rates["tau_3"]),
        exchange_3=rates["tau_3"],
        warm_2=np.sign(rates["tau_2"]),
        exchange_2=rates["tau_2"],
        pipe_on=piped,
        pipe_area=piped * p["A_pipe"],
        near_share=near_share,
        far_share=per_far_share,
        supply_loss=0.5 * RT * p["z_supply"] ** 2,
        lag_2_on=np.sign(rates["tau_p2"]),
        lag_2_rate=rates["tau_p2"],
        lag_3_on=np.sign(rates["tau_p3"]),
        lag_3_rate=rates["tau_p3"],
        steady_step=STABLE / fastest,
        clamp_step=STABLE / np.maximum(clamp_rate, STABLE / UNLIMITED),
        slow_step_PV=FRICTION_STABLE / np.maximum(friction_rate_PV, STABLE / UNLIMITED),
        slow_step_MV=FRICTION_STABLE / np.maximum(friction_rate_MV, STABLE / UNLIMITED),
    )
    return np.ascontiguousarray(np.broadcast_arrays(*np.atleast_1d(*rows)), dtype=float)


def _rate(time: NDArray) -> NDArray:
    """1/time, or 0 where the time is too short to be felt."""
    return np.where(time < SHORTEST_TIME, 0.0, 1 / np.maximum(time, SHORTEST_TIME))


def has_effects(effects: NDArray) -> NDArray:
    """Which valves have an effect switched on, boolean (valve,); RT, steps and V2's part are none."""
    sizes = Effects(*effects)
    properties = ("RT", "near_share", "steady_step", "clamp_step", "slow_step_PV", "slow_step_MV")
    return np.any([getattr(sizes, f) != 0 for f in Effects._fields if f not in properties], axis=0)
