"""Friction of seals: half the force loop, less what the regulator's droop puts into it."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy import signal, stats

from docs.component_data.files import Array, columns

SEALS = {"O-ring257": 0.0257, "X-ring257": 0.0257, "Circle": 0.025}
"""Bores by seal [m] (the authors' notebook): what turns pressure into force."""
PRESSURES = (1, 3, 5, 7)
"""Gauge pressures of the runs [bar]."""
UNSTEADY = ("X-ring257", 7)
"""Its friction grows by a quarter within nine cycles: no part of the seal's line over pressure."""
RNG_SEED = 1
"""Of the bootstrap."""


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Friction of one seal at one pressure."""

    halves: Array
    """Half the loop between 8 and 28 mm, by cycle [N]."""
    raw: float
    """The same without taking the pressure's difference between the strokes out [N]."""
    speeds: tuple[float, float]
    """Mean speed in, out [m/s]."""
    first_excess: float
    """Friction at the first break-away over that of the first cycle, less 1 [-]; nan: not recorded."""
    first_peaked: bool
    """Whether the record shows the break-away's fall; else its excess is a lower bound."""
    reversal_excess: float
    """The same within 5 mm of a reversal, mean over the strokes [-]."""

    @property
    def mean(self) -> float:
        """Sliding friction [N]."""
        return float(self.halves.mean())


def strokes(position: Array) -> list[slice]:
    """Strokes between reversals [samples], for positions in metres over a stroke of about 40 mm."""
    far = signal.find_peaks(position, prominence=0.02, distance=100)[0]
    near = signal.find_peaks(-position, prominence=0.02, distance=100)[0]
    turns = np.sort(np.r_[far, near])
    return [slice(a, b) for a, b in pairwise(turns.tolist())]


def window_means(values: Array, position: Array, parts: list[slice]) -> tuple[Array, Array]:
    """Means of the strokes in and out between 8 and 28 mm, as many of each."""
    means: dict[bool, list[float]] = {True: [], False: []}
    for part in parts:
        x = position[part]
        inside = (x > 0.008) & (x < 0.028)
        means[bool(x[-1] > x[0])].append(float(values[part][inside].mean()))
    count = min(len(means[True]), len(means[False]))
    return np.array(means[True][:count]), np.array(means[False][:count])


def friction_loop(time: Array, position: Array, pressure: Array, force: Array, bore: float) -> Loop:
    """Friction from one run; SI units, gauge pressure."""
    parts = strokes(position)
    if len(parts) < 2:
        raise ValueError("a friction run needs two strokes or more: take a longer record")
    # The regulator holds 0.1-0.2 bar more on the way in: the loop of the force alone is no friction.
    rest = force - pressure * np.pi / 4 * bore**2
    inward, outward = window_means(rest, position, parts)
    raw_in, raw_out = window_means(force, position, parts)
    fast_in, fast_out = window_means(np.gradient(position, time), position, parts)
    halves = (inward - outward) / 2
    friction = rest - (inward.mean() + outward.mean()) / 2
    excess, peaked = first_excess(position, friction, halves[0])
    return Loop(
        halves=halves,
        raw=float((raw_in.mean() - raw_out.mean()) / 2),
        speeds=(float(fast_in.mean()), float(-fast_out.mean())),
        first_excess=excess,
        first_peaked=peaked,
        reversal_excess=reversal_excess(position, friction, parts, float(halves.mean())),
    )


def first_excess(position: Array, friction: Array, sliding: float) -> tuple[float, bool]:
    """Excess of the break-away from the rest before the first stroke [-], and whether its fall shows."""
    start = int(np.argmax(position > 0.0006))
    # Some records lost the first 0.3 s: without the rise from rest there is no break-away to see.
    if start < 8 or abs(position[0]) > 5e-4:
        return float("nan"), False
    peak = int(np.argmax(friction[:start]))
    return float(friction[peak] / sliding - 1), peak < start - 1


def reversal_excess(position: Array, friction: Array, parts: list[slice], sliding: float) -> float:
    """Excess within 5 mm of a reversal, on the mean over the strokes, which takes the noise out [-]."""
    distances = np.linspace(0.0005, 0.005, 46)
    profiles = []
    for part in parts:
        sign = np.sign(position[part][-1] - position[part][0])
        travelled = np.maximum.accumulate(sign * (position[part] - position[part][0]))
        profiles.append(np.interp(distances, travelled, sign * friction[part]))
    return float(np.mean(profiles, axis=0).max() / sliding - 1)


def read_loop(data: Path, seal: str, bar: int) -> Loop:
    """Friction of a seal at a pressure, from its file."""
    path = data / "friction" / f"{seal}_{bar}bar.csv"
    time, position, pressure, force = columns(path, (0, 4, 5, 6), delimiter="\t")
    try:
        return friction_loop(time * 1e-3, position * 1e-3, pressure * 1e5, force, SEALS[seal])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


@dataclass(frozen=True, kw_only=True)
class Line:
    """Friction over pressure, with 95 % intervals."""

    constant: float
    """At no pressure [N]."""
    slope: float
    """Per pressure [N/bar]."""
    constant_half: float
    """Half its interval [N]; Student's, since four pressures scatter more than the cycles do."""
    slope_half: float
    """Half its interval [N/bar]."""


def line(pressures: Array, frictions: Array) -> Line:
    """Least squares."""
    (slope, constant), covariance = np.polyfit(pressures, frictions, 1, cov=True)
    halves = stats.t.ppf(0.975, len(pressures) - 2) * np.sqrt(np.diag(covariance))
    return Line(constant=constant, slope=slope, constant_half=halves[1], slope_half=halves[0])


def seal_line(loops: dict[tuple[str, int], Loop], seal: str) -> Line:
    """Sliding friction of a seal over pressure."""
    steady = [bar for bar in PRESSURES if (seal, bar) != UNSTEADY]
    return line(np.array(steady, float), np.array([loops[seal, bar].mean for bar in steady]))


def interval(values: Array) -> tuple[float, float]:
    """95 % bootstrap interval of the mean."""
    found = stats.bootstrap(
        (values,), np.mean, n_resamples=1000, rng=np.random.default_rng(RNG_SEED), method="percentile"
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)
