"""Small plants of plain differential equations, with readings of zero."""

import numpy as np

from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Cause, Channel, FreeParameter, NuisanceParameter, Run


def quiet_run(period: float, samples: int, **inputs) -> Run:
    return Run(
        name="run",
        held_out=True,
        time=period * np.arange(samples),
        measured=np.zeros((1, samples)),
        trusted=np.ones((1, samples), dtype=bool),
        inputs=inputs,
    )


def free(symbol: str, nominal: float, trials: tuple[float, ...] = ()) -> FreeParameter:
    return FreeParameter(symbol=symbol, unit="1", low=-10.0, high=10.0, nominal=nominal, trials=trials)


def decay_rate(x, u, p):
    return (-p.k * x.y + p.gain * u.q,)


def decay(runs=None, **changes) -> OdePlant:
    """y' = -k y + gain q from y = 1."""
    return OdePlant(
        **{
            "runs": [quiet_run(0.5, 21, q=np.zeros(21))] if runs is None else runs,
            "channels": [Channel(name="y", unit="m", scale=1.0, noise=1e-3)],
            "states": ("y",),
            "rate": decay_rate,
            "readings": lambda x, u, p: (x.y + p.zero,),
            "start": lambda run, p: (1.0,),
            "parameters": [free("k", 1.0)],
            "causes": [Cause(name="gain", component="valve", parameters=(free("gain", 1.0, (2.0,)),))],
            "run_offsets": [NuisanceParameter(symbol="zero", sd=0.1, step=0.01)],
            "tolerances": [NuisanceParameter(symbol="late", sd=0.1, step=0.01)],
            "forcing_steps": {"y": 1e-3},
            "mode": "python",
        }
        | changes
    )
