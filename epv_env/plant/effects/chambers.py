"""Effects of the chambers: warm gas, a volume that the piston sweeps, a circuit behind a pipe."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.record import Constant, Effect, Size, rate
from epv_env.plant.primitives import KAPPA, LAMINAR_DROP, QUARTER_PI, inlined


def _heat(chamber: str, number: int, size: Size) -> Effect:
    """Gas of a chamber whose temperature departs from T_env and relaxes to the wall's."""
    symbol = size.symbol
    return Effect(
        name=f"{chamber}_heat",
        component=chamber,
        strength=(f"exchange_{number}",),
        form="T = T_env (1 + h); dp/dt = κ (RT/V (w_in − (1 + h) w_out) − p V'/V) − p h/((1 + h) τ)",
        source=(
            "first law for an open chamber, air entering at T_env, heat to the wall by Newton's law: "
            "τ → 0 isothermal, τ → ∞ adiabatic"
        ),
        sizes=(size,),
        constants=(
            # 1 where the chamber's gas temperature is free, 0 where it is T_env [-]
            Constant(f"warm_{number}", lambda p: np.sign(rate(p[symbol]))),
            # rate at which that temperature relaxes to the wall's [1/s]
            Constant(f"exchange_{number}", lambda p: rate(p[symbol])),
        ),
        fastest_rate=lambda p: rate(p[symbol]),
    )


CONTROL_CHAMBER_HEAT = _heat(
    "control_chamber",
    3,
    Size(
        symbol="tau_3",
        unit="s",
        domain=(0, 2),
        meaning="time constant of the control chamber's gas temperature",
        trials=(0.01, 0.1),
        least_fitted=5e-4,
        drawn=(4e-3, 0.4),
    ),
)

OUTPUT_CHAMBER_HEAT = _heat(
    "output_chamber",
    2,
    Size(
        symbol="tau_2",
        unit="s",
        domain=(0, 2),
        meaning="time constant of the output chamber's gas temperature",
        trials=(0.05, 0.5),
        least_fitted=5e-4,
        drawn=(0.02, 1.0),
    ),
)

MOVING_CONTROL_VOLUME = Effect(
    name="moving_control_volume",
    component="control_chamber",
    strength=("swept",),
    form="V3 − s π/4 d1² xPV, with its work on p3",
    source="geometry at s = 1: a tenth of V3",
    sizes=(
        Size(
            symbol="sV3",
            unit="1",
            domain=(0, 1.5),
            meaning="share of the piston's area that sweeps the control chamber",
            trials=(0.6,),
            drawn=(0.13, 1.3),
        ),
    ),
    constants=(
        # swept area over the control chamber's volume [1/m]
        Constant("swept", lambda p: p["sV3"] * QUARTER_PI * p["d1"] ** 2 / p["V3"]),
    ),
)


def _far_share(p: Mapping[str, NDArray]) -> NDArray:
    """Share of V2 behind the pipe [-], 0 where it is less than a hundredth: no pipe acts then."""
    return np.where(p["s_pipe"] < 0.01, 0.0, p["s_pipe"])


def _piped(p: Mapping[str, NDArray]) -> NDArray:
    """1 where part of the circuit lies behind a pipe, else 0 [-]."""
    return (_far_share(p) > 0).astype(float)


def _per_far_share(p: Mapping[str, NDArray]) -> NDArray:
    """V2 over its part behind the pipe [-]; 0 without a pipe."""
    share = _far_share(p)
    return _piped(p) / np.where(share > 0, share, 1.0)


def _per_near_share(p: Mapping[str, NDArray]) -> NDArray:
    """V2 over its part before the pipe [-]."""
    return 1 / (1 - _far_share(p))


def _pipe_rate(p: Mapping[str, NDArray]) -> NDArray:
    """Rate at which the pressures before and behind the pipe meet [1/s].

    An orifice's flow rises steepest within its laminar region, where the bracket of `mass_flux` is 2.
    """
    RT = p["R_gas"] * p["T_env"]
    steepest = np.sqrt(2 * RT / LAMINAR_DROP)
    return _piped(p) * p["A_pipe"] * steepest / p["V2"] * (_per_far_share(p) + _per_near_share(p))


OUTPUT_PIPE = Effect(
    name="output_pipe",
    component="output_chamber",
    strength=("pipe_area",),
    form=(
        "the circuit as two volumes, (1 − s) V2 at the valve and s V2, with the consumer, behind an "
        "orifice A"
    ),
    source="two volumes and an orifice; A of 2.8·10⁻⁵ m²: a bore of 6 mm",
    sizes=(
        Size(
            symbol="s_pipe",
            unit="1",
            domain=(0, 0.9),
            meaning="share of V2 that lies behind a pipe",
            trials=(0.4,),
            least_fitted=0.05,
            drawn=(0.15, 0.8),
        ),
        Size(
            symbol="A_pipe",
            unit="m^2",
            domain=(0, 1e-4),
            meaning="effective area of that pipe",
            trials=(2e-5,),
            least_fitted=2e-6,
            drawn=(8e-6, 6e-5),
            stronger_when_smaller=True,
        ),
    ),
    constants=(
        # 1 where part of the circuit lies behind a pipe, else 0 [-]
        Constant("pipe_on", _piped),
        # effective area of that pipe [m^2]
        Constant("pipe_area", lambda p: _piped(p) * p["A_pipe"]),
        # V2 over its part before the pipe [-]
        Constant("near_share", _per_near_share, is_size=False),
        # V2 over its part behind the pipe [-]; 0 without one
        Constant("far_share", _per_far_share),
    ),
    fastest_rate=_pipe_rate,
)


@inlined
def chamber_rates(p, heat, RT_V, inflow, outflow, expansion, warm, exchange):
    """Rates of a chamber's pressure [Pa/s] and of its gas's relative temperature rise [1/s].

    First law for air that enters at T_env and leaves as it is, with heat passing to the wall (Newton):
    dp/dt = kappa (R T_env/V (in - (1 + heat) out) - p expansion) - exchange p heat/(1 + heat). RT_V:
    R T_env/V [Pa/kg]. expansion: dV/dt over V [1/s]. warm = 0 holds the gas at T_env.
    """
    isothermal = RT_V * (inflow - outflow) - p * expansion
    lost = exchange * p * heat / (1.0 + heat)
    free = KAPPA * (RT_V * (inflow - (1.0 + heat) * outflow) - p * expansion) - lost
    rate = isothermal + warm * (free - isothermal)
    air_rate = (1.0 + heat) * RT_V * (inflow - outflow) / p
    return rate, warm * (1.0 + heat) * (rate / p + expansion - air_rate)


@inlined
def pipe_rate(inflow, p2_rate, RT_V2, effects):
    """Rate of the far pressure less p2 [Pa/s]; inflow: net, into the part behind the pipe [kg/s]."""
    return effects.pipe_on * (RT_V2 * effects.far_share * inflow - p2_rate)
