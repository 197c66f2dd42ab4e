"""A lightly damped, driven oscillator whose nominal model knows viscous drag alone, as a `GreyBox`."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import (
    Channel,
    FreeParameter,
    NuisanceParameter,
    Run,
    StateEquation,
    StateTrace,
)

NOISE = 2e-3
"""Of the angle's readings [rad]."""

DAMPING = 0.05
"""Viscous drag over mass, which is known [1/s]."""

SPEED_OF_SIGN = 0.05
"""Speed over which Coulomb friction changes its sign [rad/s]."""


class Oscillator:
    """x' = v, v' = u - w0^2 x - c v - missing drag; x is read."""

    def __init__(self, runs: Sequence[Run]):
        self.runs = tuple(runs)
        self.channels = (Channel(name="x", unit="rad", scale=1.0, noise=NOISE),)
        self.parameters = (
            FreeParameter(symbol="w0", unit="rad/s", low=5.0, high=7.0, nominal=5.8, scale=5.8),
        )
        self.causes = ()
        self.tolerances = ()
        self.run_offsets = (
            NuisanceParameter(symbol="x0", sd=0.01, step=1e-3),
            NuisanceParameter(symbol="v0", sd=0.05, step=5e-3),
        )
        self.equations = (
            StateEquation(name="f1", state="x", component="arm", unit="rad/s", step=0.0),
            StateEquation(name="f2", state="v", component="arm", unit="rad/s^2", step=1e-3),
        )

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`."""
        return [self._swing(values, r)[0][None] for r in runs]

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`."""
        x, v = self._swing(values, run)
        return {
            "x": StateTrace(unit="rad", scale=1.0, values=x[:, 0]),
            "v": StateTrace(unit="rad/s", scale=1.0, values=v[:, 0]),
        }

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: a swing has none."""
        return {}

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`."""
        (acting,) = forcing.values()
        return (self._swing(values, run, acting)[0] - self._swing(values, run)[0])[None]

    def _swing(
        self, values: Mapping[str, NDArray], run: int, forcing: NDArray | None = None
    ) -> tuple[NDArray, NDArray]:
        """Angle [rad] and speed [rad/s] in a run, (samples, n) each."""
        given = {s: np.asarray(v) for s, v in values.items()}
        own = {s: v[:, run] if v.ndim == 2 else v for s, v in given.items()}
        nominal = {p.symbol: np.array([p.nominal]) for p in self.parameters}
        drive = self.runs[run].inputs["u"][:, None]
        total = drive if forcing is None else drive + forcing
        return swing({"c": np.array([DAMPING]), **nominal, **own}, float(self.runs[run].time[1]), total)


def swing(p: Mapping[str, NDArray], step: float, force: NDArray) -> tuple[NDArray, NDArray]:
    """Angle [rad] and speed [rad/s], (samples, n) each, by Runge-Kutta steps.

    p: parameters, (1,) or (n,) each. step: sampling period [s]. force: (samples, 1) or (samples, n)
    [rad/s^2], constant between samples.
    """
    zero = np.zeros(1)
    x = p.get("x0", zero) + 0.0 * (force[0] + sum(p.values()))
    v = p.get("v0", zero) + 0.0 * x

    def rate(x: NDArray, v: NDArray, force: NDArray) -> NDArray:
        drag = p.get("quadratic", zero) * v * np.abs(v)
        drag = drag + p.get("coulomb", zero) * np.tanh(v / SPEED_OF_SIGN)
        return force - p["w0"] ** 2 * x - p["c"] * v - drag

    xs, vs = np.empty((len(force), *x.shape)), np.empty((len(force), *x.shape))
    for i, f in enumerate(force):
        xs[i], vs[i] = x, v
        k1 = rate(x, v, f)
        k2 = rate(x + step / 2 * v, v + step / 2 * k1, f)
        k3 = rate(x + step / 2 * v + step**2 / 4 * k1, v + step / 2 * k2, f)
        k4 = rate(x + step * v + step**2 / 2 * k2, v + step * k3, f)
        x = x + step * v + step**2 / 6 * (k1 + k2 + k3)
        v = v + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return xs, vs


def swung(truth: Mapping[str, float], periods: int, samples: int, seed: int = 1) -> Oscillator:
    """Two recordings of an oscillator driven once a second, at levels that change; one is held out.

    truth: parameters other than the nominal ones [SI]. samples: in a period of the drive.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(periods * samples) / samples
    runs = []
    for name in ("first", "second"):
        levels = np.repeat(rng.uniform(0.2, 1.0, periods // 60), 60 * samples)
        runs.append(
            Run(
                name=name,
                held_out=name == "second",
                time=time,
                measured=np.zeros((1, len(time))),
                trusted=np.ones((1, len(time)), dtype=bool),
                inputs={"u": levels * np.sin(2 * np.pi * time)},
            )
        )
    oscillator = Oscillator(runs)
    exact = oscillator.outputs({s: np.array([v]) for s, v in truth.items()}, (0, 1))
    for run, output in zip(oscillator.runs, exact, strict=True):
        run.measured[:] = output[:, :, 0] + NOISE * rng.standard_normal(run.measured.shape)
    return oscillator
