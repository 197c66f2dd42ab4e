"""The state equations typed a second time, in plain NumPy from the parameters of the tables.

Independent of epv_env.plant.equations, flow, effects and coefficients: raw symbols, both powers of
eq. 13, no polynomial, no folded products. It checks those, and is the peer in the speed comparison.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.equations import Inputs, State
from epv_env.plant.primitives import LAMINAR_DROP


def exact_flux(p_a, p_b, p: Mapping[str, float]):
    """Isentropic mass flux from a to b [kg/(s m^2)], choked and reversed (eqs 13, 14 corrected)."""
    kappa, RT = p["kappa"], p["R_gas"] * p["T_env"]
    upstream, downstream = np.maximum(p_a, p_b), np.minimum(p_a, p_b)
    critical = np.power(2 / (kappa + 1), kappa / (kappa - 1))
    ratio = np.maximum(downstream / upstream, critical)
    bracket = np.power(ratio, 2 / kappa) - np.power(ratio, (kappa + 1) / kappa)
    laminar = np.minimum((1 - ratio) / LAMINAR_DROP, 1)
    flux = upstream * np.sqrt(2 * kappa / ((kappa - 1) * RT) * bracket * laminar)
    return np.where(p_a > p_b, flux, -flux)


def numpy_rates(
    q: State, u: Inputs, p: Mapping[str, float], reservoir_volume: float = np.inf
) -> tuple[State, NDArray, NDArray]:
    """Rates of a free valve (eqs 5-12 corrected), force on piston, force on armature [N]."""
    RT = p["R_gas"] * p["T_env"]
    magnet_area = np.pi / 4 * np.power(p["dMB"], 2)
    reluctance = p["RML"] + (p["xMVmax"] - q.xMV) / (p["mu0"] * magnet_area)
    inlet_area = np.minimum(np.pi * p["dMVin"] * q.xMV, np.pi / 4 * np.power(p["dMVin"], 2))
    exhaust_area = np.minimum(
        np.pi * p["dMVexh"] * (p["xMVmax"] - q.xMV), np.pi / 4 * np.power(p["dMVexh"], 2)
    )
    through_PV = p["alphaPV"] * p["d2"] * np.pi * q.xPV * exact_flux(q.p1, q.p2, p)
    inlet = p["alphaMV"] * inlet_area * exact_flux(q.p1, q.p3, p)
    exhaust = p["alphaMV"] * exhaust_area * exact_flux(q.p3, p["p_env"], p)
    force_PV = _piston_force(q, p)
    force_MV = (
        np.power(p["N"] * q.I / reluctance, 2) / (2 * p["mu0"] * magnet_area)
        - p["cMV"] * (q.xMV + p["xMV0"])
        - p["kMV"] * q.vMV
    )
    current = (u.U - p["R"] * q.I) * reluctance / np.power(p["N"], 2) - q.I * q.vMV / (
        reluctance * p["mu0"] * magnet_area
    )
    rates = State(
        p2=RT / p["V2"] * (through_PV - u.sigma_S),
        p3=RT / p["V3"] * (inlet - exhaust),
        xPV=q.vPV,
        vPV=force_PV / p["mPV"],
        xMV=q.vMV,
        vMV=force_MV / p["mMV"],
        I=current,
        p1=u.p1_slope + RT / reservoir_volume * (u.refill - through_PV - inlet),
        air_in_PV=through_PV,
        air_in_MV=inlet,
        air_vented=exhaust,
        coil_energy=u.U * q.I,
    )
    rates = State(*np.broadcast_arrays(*rates)) if np.ndim(q.p2) else rates
    return rates, force_PV, force_MV


def _piston_force(q: State, p: Mapping[str, float]):
    """Eq. 9 with p3 on the back and the cone model of eq. 15 [N]."""
    exponent = (p["kappa"] - 1) / p["kappa"]
    ratio = np.minimum(q.p2 / q.p1, 1)
    gas_speed = np.sqrt(2 / exponent * p["R_gas"] * p["T_env"] * (1 - np.power(ratio, exponent)))
    effective = p["d2"] - 2 * q.xPV * (p["a1"] + p["a2"] * gas_speed)
    return (
        q.p1 * np.pi / 4 * (np.power(p["d1"], 2) - np.power(effective, 2))
        + q.p2 * np.pi / 4 * np.power(effective, 2)
        - q.p3 * np.pi / 4 * np.power(p["d1"], 2)
        - p["cPV"] * (q.xPV + p["xPV0"])
        - p["kPV"] * q.vPV
    )
