"""Recordings are screened before anything is fitted: no fit rests on what is faulty, and it is named.

Faults are wild readings, and stretches that are stuck, clipped or lost. A reading is wild if it departs
far beyond noise from every course through its neighbours (a running median finds candidates: Hampel
1974). Equal readings are a fault where noise moves all others. A step, a kink and a transient of some
samples are neither.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.stats import norm

from identification.gap.plant import Channel, PlantError, Run
from identification.noise import (
    NORMAL,
    differences,
    distances,
    noise_despite_faults,
    quantisation_step,
    rounding_error,
)

Kind = Literal["wild", "stuck", "clipped", "dropout"]

FAR = 8.0
"""Least departure of a wild reading, and least jump at a dropout [noise deviations]: white noise reaches
6 once in a billion readings. Equal readings in a row are a fault if they are as improbable."""

MOST_FAULTY = 0.5
"""Greatest share of a channel's readings that is a fault [1]: more may be how the plant rests."""

MEDIAN, LONGEST_WILD, NEIGHBOURS = 7, 2, 3
"""Readings of the running median; wild ones in a row; and on each side of a reading that tell its
course."""

WORDS: Mapping[Kind, str] = {
    "wild": "wild readings",
    "stuck": "readings that are stuck",
    "clipped": "readings that are clipped",
    "dropout": "dropouts",
}


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Faulty readings of one kind, in one output or input of one run."""

    file: str
    """Name of the run."""
    channel: str
    samples: tuple[int, ...]
    kind: Kind

    @property
    def place(self) -> str:
        """Which readings they are, in words."""
        ends = [i for i, j in pairwise(self.samples) if j > i + 1]
        starts = [j for i, j in pairwise(self.samples) if j > i + 1]
        parts = zip([self.samples[0], *starts], [*ends, self.samples[-1]], strict=True)
        texts = [f"{a} to {b}" if b > a else f"{a}" for a, b in parts]
        return f"{self.channel} of {self.file} at sample {', '.join(texts)}"


def sentences(found: Sequence[Finding]) -> list[str]:
    """What was found, one sentence for each kind without a full stop."""
    return [
        f"{words}, to which nothing is fitted: {'; '.join(places)}"
        for kind, words in WORDS.items()
        if (places := [own.place for own in found if own.kind == kind])
    ]


def screen(
    runs: Sequence[Run], channels: Sequence[Channel]
) -> tuple[tuple[Run, ...], tuple[Finding, ...]]:
    """Runs without their faulty readings, and what was found.

    A faulty reading of a channel is not trusted any more. It and a wild sample of an input become the
    straight line between their neighbours.

    Args:
        runs: of the right shapes; a trusted reading that is NaN is a dropout.
        channels: what the runs measure.

    Raises:
        PlantError: more than half the readings of a run's channel are faulty; one sentence each.
    """
    inputs = [dict(run.inputs) for run in runs]
    kept = [
        replace(run, measured=np.array(run.measured, float), trusted=run.trusted.copy(), inputs=own)
        for run, own in zip(runs, inputs, strict=True)
    ]
    outputs = [channel.name for channel in channels]
    found = []
    for c, channel in enumerate(channels):
        counting = [np.flatnonzero(run.trusted[c]) for run in runs]
        series = [run.measured[c, own] for run, own in zip(runs, counting, strict=True)]
        for r, kind, places in faults(series, channel):
            samples = counting[r][places]
            kept[r].measured[c] = bridged(kept[r].measured[c], samples)
            kept[r].trusted[c, samples] = False
            found.append(_finding(runs[r], channel.name, samples, kind))
    for name in dict.fromkeys(name for run in runs for name in run.inputs):
        own = [r for r, run in enumerate(runs) if name in run.inputs]
        for i, kind, samples in faults([runs[r].inputs[name] for r in own]):
            inputs[own[i]][name] = bridged(inputs[own[i]][name], samples)
            found.append(_finding(runs[own[i]], name, samples, kind))
    unusable = [
        f"run {run.name}: {np.sum(before & ~after)} of {np.sum(before)} readings of channel {name} are "
        "wild, stuck, clipped or lost: leave the run out, or trust none of them"
        for run, left in zip(runs, kept, strict=True)
        for name, before, after in zip(outputs, run.trusted, left.trusted, strict=True)
        if np.sum(before & ~after) > MOST_FAULTY * np.sum(before)
    ]
    if unusable:
        raise PlantError("\n".join(unusable))
    return tuple(kept), tuple(found)


def _finding(run: Run, channel: str, samples: NDArray, kind: Kind) -> Finding:
    ordered = tuple(int(i) for i in np.sort(samples))
    return Finding(file=run.name, channel=channel, samples=ordered, kind=kind)


def bridged(signal: NDArray, samples: NDArray) -> NDArray:
    """The signal (samples,) with straight lines across some samples."""
    good = np.setdiff1d(np.arange(len(signal)), samples)
    return np.interp(np.arange(len(signal)), good, signal[good]) if len(good) else signal


def faults(
    series: Sequence[NDArray], channel: Channel | None = None
) -> Iterator[tuple[int, Kind, NDArray]]:
    """Faults of a signal: which series, the kind, and the places in the series.

    series: consecutive readings of each run, (readings,). channel: None for an input, which may be held
    at will, so that only wild samples are a fault.
    """
    places = [np.flatnonzero(np.isfinite(own)) for own in series]
    values = [own[at] for own, at in zip(series, places, strict=True)]
    noise, resolution = (channel.noise or 0.0, channel.resolution) if channel else (0.0, 0.0)
    seen = _noise(values)
    scale = max(noise, seen, rounding_error(resolution or quantisation_step(values)))
    for r, own in enumerate(values):
        if len(own) < len(series[r]):
            yield r, "dropout", np.flatnonzero(~np.isfinite(series[r]))
        wild = _wild(own, scale, held=channel is None)
        if len(wild):
            yield r, "wild", places[r][wild]
            values[r], places[r] = np.delete(own, wild), np.delete(places[r], wild)
    if channel:
        for r, kind, at in _flat(values, _equal_by_noise(values, seen, noise), FAR * scale):
            yield r, kind, places[r][at]


def _noise(series: Sequence[NDArray]) -> float:
    """Standard deviation of the noise about a smooth course, whatever a few readings are; 0: none."""
    moving = [own[~_in_row(own, LONGEST_WILD + 1)] for own in series]
    if sum(map(len, moving)) < (1.0 - MOST_FAULTY) * sum(map(len, series)):
        moving = series
    return noise_despite_faults(moving)


def _wild(readings: NDArray, noise: float, held: bool) -> NDArray:
    """Places of wild readings among (readings,), found again and again, as one may hide another.

    held: whether a pulse between held values is none.
    """
    left = np.arange(len(readings))
    while len(left) > MEDIAN and len(found := _departing(readings[left], noise, held)):
        left = np.delete(left, found)
    return np.setdiff1d(np.arange(len(readings)), left)


def _departing(y: NDArray, noise: float, held: bool) -> NDArray:
    """Places of readings (readings,) that depart from every course through their neighbours."""
    rough = np.pad(np.abs(differences(y, 2)), 1, mode="reflect")
    scale = np.maximum(noise, NORMAL * median_filter(rough, 31, mode="mirror"))  # the noise nearby
    smooth = _smooth(y)
    candidates = np.abs(y - smooth) > FAR * scale
    candidates &= ~_in_row(candidates, LONGEST_WILD + 1)
    rest = np.flatnonzero(~candidates)
    span = np.ptp(smooth)
    beyond = np.maximum(smooth.min() - y, y - smooth.max()) > span + FAR * scale
    return np.array(
        [
            i
            for i in np.flatnonzero(candidates)
            if (beyond[i] and span > 0) or _is_lone(y, int(i), rest, scale[i], held)
        ],
        dtype=int,
    )


def _smooth(y: NDArray) -> NDArray:
    """Median of the readings about each one (readings,), along their median slope."""
    first = np.clip(np.arange(len(y)) - MEDIAN // 2, 0, len(y) - MEDIAN)
    window = sliding_window_view(y, MEDIAN)[first]
    away = first[:, None] + np.arange(MEDIAN) - np.arange(len(y))[:, None]
    slope = np.median(np.diff(window, axis=1), axis=1, keepdims=True)
    return np.median(window - slope * away, axis=1)


def _is_lone(y: NDArray, i: int, rest: NDArray, scale: float, held: bool) -> bool:
    """Whether reading i is on no course through its neighbours among `rest`, which lie on one."""
    k = int(np.searchsorted(rest, i))
    near = rest[max(k - NEIGHBOURS, 0) : k + NEIGHBOURS]
    if not 2 <= k <= len(rest) - 2 or np.max(np.abs(near - i)) > 2 * NEIGHBOURS:
        return False
    if held and np.ptp(y[near]) == 0:
        return False
    course = np.polynomial.Polynomial.fit(near, y[near], 2)
    (a, b), (c, d) = rest[k - 2 : k], rest[k : k + 2]
    left, right = (y[b] - y[a]) / (b - a), (y[d] - y[c]) / (d - c)
    expected = [course(i), y[b], y[c], y[b] + left * (i - b), y[c] + right * (i - c)]
    rough = max(float(np.max(np.abs(y[near] - course(near)))) - 2 * scale, 0.0)  # noise leaves 2
    # The cusp of a current when an armature lands is 6 times as rough, a step below 3 times.
    return bool(np.min(np.abs(y[i] - np.array(expected))) > FAR * scale + 20.0 * rough)


def _flat(series: Sequence[NDArray], equal: float, far: float) -> Iterator[tuple[int, Kind, NDArray]]:
    """Stretches of equal readings that are a fault: which series, kind, places.

    equal: probability that noise leaves two neighbours equal [1]. far: a jump beyond noise.
    """
    everything = np.concatenate(series)
    lively = everything[everything != 0]
    rows = [(own[a], b - a) for own in series for a, b in _rows(own)]
    rows_values, rows_lengths = np.array(rows).reshape(-1, 2).T
    never_0 = far > 0 and len(lively) > MOST_FAULTY * len(everything) and np.all(np.abs(lively) > far)
    for r, own in enumerate(series):
        found: dict[Kind, set[int]] = {}
        for a, b in (row for row in _rows(own) if row[1] - row[0] > LONGEST_WILD):
            extreme = own[a] in (np.min(own), np.max(own))
            alike = rows_lengths[rows_values == own[a]]
            stays = max(equal, 0.0 if extreme else _stays(alike, b - a))
            if (equal < 1 and _is_notch(own, a, b, far)) or (never_0 and own[a] == 0):
                found.setdefault("dropout", set()).update(range(a, b))
            elif own[a] == 0 or stays ** (b - a - 1) > norm.sf(FAR):
                continue  # a plant may rest at 0
            elif extreme:
                found.setdefault("clipped", set()).update(np.flatnonzero(own == own[a]).tolist())
            else:
                found.setdefault("stuck", set()).update(range(a, b))
        for kind, places in found.items():
            yield r, kind, np.array(sorted(places))


def _is_notch(y: NDArray, a: int, b: int, far: float) -> bool:
    """Whether readings a to b lie off those before and after, to the same side, at two sudden jumps."""
    if a < 2 or b > len(y) - 2:
        return False
    jumps = np.array([y[a - 1] - y[a], y[b] - y[a]])
    usual = np.abs([y[a - 1] - y[a - 2], y[b + 1] - y[b]])
    sudden = np.abs(jumps) > np.maximum(far, FAR * usual)
    return bool(np.all(sudden) and jumps[0] * jumps[1] > 0)


def _equal_by_noise(series: Sequence[NDArray], seen: float, noise: float) -> float:
    """Probability that two neighbours are equal [1]; 1 where noise does not move nearly all readings.

    series: readings of each run, (readings,). seen: their noise. noise: as it is said to be.
    """
    lengths = np.array([b - a for own in series for a, b in _rows(own)])
    step = np.min(distances(series), initial=np.inf)
    resting = np.sum(lengths[lengths > LONGEST_WILD]) > MOST_FAULTY * np.sum(lengths)
    if not len(lengths) or np.median(lengths) > 1 or resting or seen <= max(step, noise / FAR):
        return 1.0
    return float(max(2 * norm.cdf(step / (2 * seen)) - 1, np.mean(lengths > 1)))


def _stays(rows: NDArray, length: int) -> float:
    """How often a reading of a value is followed by an equal one [1], but for one row of this length.

    rows: lengths of all rows of the value, (rows,).
    """
    others = np.sum(rows) - length
    return 1.0 - (len(rows) - 1) / others if others else 0.0


def _rows(values: NDArray) -> list[tuple[int, int]]:
    """First place of each row of equal values, and its end."""
    borders = [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist(), len(values)]
    return [(a, b) for a, b in pairwise(borders) if b > a]


def _in_row(values: NDArray, length: int) -> NDArray:
    """Which values (n,) stand in a row of at least so many equal ones, boolean (n,)."""
    lengths = np.array([b - a for a, b in _rows(values)], dtype=int)
    return np.repeat(lengths >= length, lengths)
