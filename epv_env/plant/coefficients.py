"""From parameters by symbol to the coefficients that the equations use."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.equations import Coefficients
from epv_env.plant.primitives import QUARTER_PI, Value


def coefficients(p: Mapping[str, ArrayLike], reservoir_volume: ArrayLike = np.inf) -> NDArray:
    """Table [row of Coefficients, valve] for one valve (scalars) or n valves (arrays of shape (n,)).

    reservoir_volume: V1 [m^3]; infinite for a supply that does not sag.
    """
    values = {symbol: np.asarray(value, dtype=float) for symbol, value in p.items()}
    rows = folded(values, np.asarray(reservoir_volume, dtype=float))
    return np.ascontiguousarray(np.broadcast_arrays(*np.atleast_1d(*rows)), dtype=float)


def folded(p: Mapping[str, Value], reservoir_volume: Value) -> Coefficients:
    """The formulas of `coefficients`, for whatever follows NumPy's arithmetic.

    p: values by symbol. reservoir_volume: V1 [m^3]. Returns values of the same kind.
    """
    RT = p["R_gas"] * p["T_env"]
    return Coefficients(
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
        RT_V1=RT / reservoir_volume,
        inverse_sqrt_RT=1 / np.sqrt(RT),
        p_env=p["p_env"],
    )
