"""Small plants of plain differential equations, with readings of zero."""

from dataclasses import replace

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


NOISE = 2e-3
"""Of the angle's readings [rad]."""

DAMPING = 0.05
"""Viscous drag over mass, which is known [1/s]."""

SPEED_OF_SIGN = 0.05
"""Speed over which Coulomb friction changes its sign [rad/s]."""


def oscillator(runs: list[Run], mode: str, quadratic: float = 0.0, coulomb: float = 0.0) -> OdePlant:
    """x' = v, v' = u - w0^2 x - c v - missing drag; x is read."""

    def rate(x, u, p):
        drag = DAMPING * x.v + quadratic * x.v * np.abs(x.v) + coulomb * np.tanh(x.v / SPEED_OF_SIGN)
        return x.v, u.u - p.w0**2 * x.x - drag

    return OdePlant(
        runs=runs,
        channels=[Channel(name="x", unit="rad", scale=1.0, noise=NOISE)],
        states=("x", "v"),
        rate=rate,
        readings=lambda x, u, p: (x.x,),
        start=lambda run, p: (p.x0, p.v0),
        parameters=[FreeParameter(symbol="w0", unit="rad/s", low=5.0, high=7.0, nominal=5.8)],
        causes=[],
        run_offsets=[
            NuisanceParameter(symbol="x0", sd=0.01, step=1e-3),
            NuisanceParameter(symbol="v0", sd=0.05, step=5e-3),
        ],
        forcing_steps={"v": 1e-3},
        mode=mode,
        steps_per_sample=1,
    )


def swung(periods: int, samples: int, seed: int = 1, **drag: float) -> OdePlant:
    """Two recordings of an oscillator driven once a second, at levels that change; one is held out.

    samples: in a period of the drive. drag: what the nominal model lacks.
    """
    rng, runs = np.random.default_rng(seed), []
    for name in ("first", "second"):
        levels = np.repeat(rng.uniform(0.2, 1.0, periods // 60), 60 * samples)
        u = levels * np.sin(2 * np.pi * np.arange(periods * samples) / samples)
        own = quiet_run(1.0 / samples, periods * samples, u=u)
        runs.append(replace(own, name=name, held_out=name == "second"))
    exact = oscillator(runs, "python", **drag).outputs({}, (0, 1))
    noisy = [y[..., 0] + NOISE * rng.standard_normal(y[..., 0].shape) for y in exact]
    recorded = [replace(run, measured=y) for run, y in zip(runs, noisy, strict=True)]
    return oscillator(recorded, "compiled")
