"""Friction of seals: half the force loop, less what the regulator's droop puts into it."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy import signal, stats

from docs.scripts.component_data.column_files import Array, columns
from docs.scripts.component_data.settings import DEFAULTS, ComponentSettings
from epv_env.common.units import BAR

SEAL_BORES = {"O-ring257": 0.0257, "X-ring257": 0.0257, "Circle": 0.025}
"""Bores by seal [m] (the authors' notebook), which turn pressure into force."""
GAUGE_PRESSURES = (1, 3, 5, 7)
"""Gauge pressures of the runs [bar]."""
UNSTEADY_RUN = ("X-ring257", 7)
"""Seal and pressure [bar] of a run whose friction grows by a quarter within nine cycles. The line over
pressure omits this run."""


@dataclass(frozen=True, kw_only=True)
class FrictionLoop:
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


def strokes(position: Array, settings: ComponentSettings = DEFAULTS) -> list[slice]:
    """Strokes between reversals [samples]. position: [m], (samples,)."""
    options = {
        "prominence": settings.reversal_prominence,
        "distance": settings.reversal_spacing,
    }
    far = signal.find_peaks(position, **options)[0]
    near = signal.find_peaks(-position, **options)[0]
    turns = np.sort(np.r_[far, near])
    return [slice(a, b) for a, b in pairwise(turns.tolist())]


def stroke_means(
    values: Array, position: Array, parts: list[slice], settings: ComponentSettings = DEFAULTS
) -> tuple[Array, Array]:
    """Means of the strokes in and of the strokes out over the sliding range, (cycles,) each.

    Args:
        values: any quantity, (samples,).
        position: [m], (samples,).
        parts: the strokes [samples].
        settings: the sliding range.
    """
    low, high = settings.sliding_range
    means: dict[bool, list[float]] = {True: [], False: []}
    for part in parts:
        x = position[part]
        inside = (x > low) & (x < high)
        means[bool(x[-1] > x[0])].append(float(values[part][inside].mean()))
    count = min(len(means[True]), len(means[False]))
    return np.array(means[True][:count]), np.array(means[False][:count])


def friction_loop(
    time: Array,
    position: Array,
    pressure: Array,
    force: Array,
    bore: float,
    settings: ComponentSettings = DEFAULTS,
) -> FrictionLoop:
    """Friction from one run.

    Args:
        time: [s], (samples,).
        position: [m], (samples,).
        pressure: gauge pressure [Pa], (samples,).
        force: of the load cell [N], (samples,).
        bore: of the seal [m].
        settings: of the analysis.

    Raises:
        ValueError: the run has fewer than two strokes.
    """
    parts = strokes(position, settings)
    if len(parts) < 2:
        raise ValueError("a friction run needs two strokes or more: take a longer record")
    # The regulator holds 0.1-0.2 bar more on the way in, so half the force loop is not the friction.
    rest = force - pressure * np.pi / 4 * bore**2
    inward, outward = stroke_means(rest, position, parts, settings)
    raw_in, raw_out = stroke_means(force, position, parts, settings)
    fast_in, fast_out = stroke_means(np.gradient(position, time), position, parts, settings)
    halves = (inward - outward) / 2
    friction = rest - (inward.mean() + outward.mean()) / 2
    excess, peaked = break_away_excess(position, friction, halves[0], settings)
    return FrictionLoop(
        halves=halves,
        raw=float((raw_in.mean() - raw_out.mean()) / 2),
        speeds=(float(fast_in.mean()), float(-fast_out.mean())),
        first_excess=excess,
        first_peaked=peaked,
        reversal_excess=reversal_excess(position, friction, parts, float(halves.mean()), settings),
    )


def break_away_excess(
    position: Array, friction: Array, sliding: float, settings: ComponentSettings = DEFAULTS
) -> tuple[float, bool]:
    """Excess of the first break-away from rest [-], and whether the record shows its fall.

    Args:
        position: [m], (samples,).
        friction: [N], (samples,).
        sliding: sliding friction of the first cycle [N].
        settings: when the first stroke has begun.

    The excess is nan for a record that does not begin at rest.
    """
    start = int(np.argmax(position > settings.start_travel))
    if start < settings.rest_samples or abs(position[0]) > settings.rest_position:
        return float("nan"), False
    peak = int(np.argmax(friction[:start]))
    return float(friction[peak] / sliding - 1), peak < start - 1


def reversal_excess(
    position: Array,
    friction: Array,
    parts: list[slice],
    sliding: float,
    settings: ComponentSettings = DEFAULTS,
) -> float:
    """Largest excess of friction shortly after a reversal [-].

    The mean over the strokes removes the noise.

    Args:
        position: [m], (samples,).
        friction: [N], (samples,).
        parts: the strokes [samples].
        sliding: sliding friction [N].
        settings: travel after a reversal.
    """
    distances = np.linspace(*settings.reversal_travel, settings.reversal_points)
    profiles = []
    for part in parts:
        sign = np.sign(position[part][-1] - position[part][0])
        travelled = np.maximum.accumulate(sign * (position[part] - position[part][0]))
        profiles.append(np.interp(distances, travelled, sign * friction[part]))
    return float(np.mean(profiles, axis=0).max() / sliding - 1)


def read_loop(data: Path, seal: str, bar: int, settings: ComponentSettings = DEFAULTS) -> FrictionLoop:
    """Friction of a seal at a gauge pressure [bar], from its file.

    Raises:
        OSError: there is no file.
        ValueError: the file does not hold a run of two strokes or more.
    """
    path = data / "friction" / f"{seal}_{bar}bar.csv"
    time, position, pressure, force = columns(path, (0, 4, 5, 6), delimiter="\t", settings=settings)
    try:
        si = (time * 1e-3, position * 1e-3, pressure * BAR, force)
        return friction_loop(*si, SEAL_BORES[seal], settings)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


@dataclass(frozen=True, kw_only=True)
class FrictionLine:
    """Friction over pressure, with 95 % intervals."""

    constant: float
    """At no pressure [N]."""
    slope: float
    """Per pressure [N/bar]."""
    constant_half: float
    """Half its interval [N]; Student's, since four pressures scatter more than the cycles do."""
    slope_half: float
    """Half its interval [N/bar]."""


def friction_line(pressures: Array, frictions: Array) -> FrictionLine:
    """Line of least squares. pressures: [bar], (n,). frictions: [N], (n,)."""
    (slope, constant), covariance = np.polyfit(pressures, frictions, 1, cov=True)
    halves = stats.t.ppf(0.975, len(pressures) - 2) * np.sqrt(np.diag(covariance))
    return FrictionLine(constant=constant, slope=slope, constant_half=halves[1], slope_half=halves[0])


def seal_line(loops: dict[tuple[str, int], FrictionLoop], seal: str) -> FrictionLine:
    """Sliding friction of a seal over pressure."""
    steady = [bar for bar in GAUGE_PRESSURES if (seal, bar) != UNSTEADY_RUN]
    return friction_line(np.array(steady, float), np.array([loops[seal, bar].mean for bar in steady]))


def mean_interval(values: Array, settings: ComponentSettings = DEFAULTS) -> tuple[float, float]:
    """95 % bootstrap interval of the mean of values (n,), in their unit."""
    interval = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=settings.resamples,
        rng=np.random.default_rng(settings.bootstrap_seed),
        method="percentile",
    ).confidence_interval
    return float(interval.low), float(interval.high)
