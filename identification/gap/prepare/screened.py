"""Recordings are screened before anything is fitted: no fit rests on what is faulty, and it is named."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import Channel, PlantError, Run
from identification.gap.prepare.faulty_readings import MOST_FAULTY, Kind, faults

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
