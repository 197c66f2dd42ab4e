"""Trials of every parameter and cause: which of them the recordings can show, and which act alike."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.model.settings import PreparationSettings


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A candidate that differs from the nominal model in one parameter or cause."""

    member: str
    """Where the plant describes it."""
    values: Mapping[str, float]
    """Values that are not nominal, by symbol [SI]."""
    calibrated: bool
    """True for a calibrated parameter, False for a cause."""


def trials(plant: GreyBox, settings: PreparationSettings) -> list[Trial]:
    """A trial of every calibrated parameter, off its nominal value, and of every cause."""
    found = []
    for p in plant.parameters:
        step = settings.trial_step * (p.high - p.low)
        value = p.nominal + (step if p.nominal + step <= p.high else -step)
        found.append(Trial(member=f"parameters, {p.symbol}", values={p.symbol: value}, calibrated=True))
    for cause in plant.causes:
        values = {p.symbol: p.trials[0] for p in cause.parameters}
        found.append(Trial(member=f"causes, {cause.label}", values=values, calibrated=False))
    return found


def side_by_side(
    plant: GreyBox, changes: Sequence[Mapping[str, float]], *, all_symbols: bool = False
) -> dict[str, NDArray]:
    """Values (n,) [SI] by symbol of n candidates.

    changes: what of each of them is not nominal [SI]. all_symbols: whether causes that do not act are
    given with their nominal values, or left out.
    """
    sizes = [p for cause in plant.causes for p in cause.parameters]
    nominal = {p.symbol: p.nominal for p in (*sizes, *plant.parameters)}
    # A plant without calibrated parameters still has to see how many candidates there are.
    used = nominal if all_symbols else [p.symbol for p in plant.parameters or sizes]
    symbols = dict.fromkeys([*used, *(symbol for own in changes for symbol in own)])
    return {s: np.array([own.get(s, nominal[s]) for own in changes], dtype=float) for s in symbols}


def magnitudes(outputs: NDArray) -> NDArray:
    """Largest magnitude of each channel of outputs (channels, samples, ...), (channels,); never 0."""
    largest = np.max(np.abs(np.nan_to_num(outputs)).reshape(len(outputs), -1), axis=1)
    return np.where(largest > 0, largest, 1.0)


def effect_warnings(plant: GreyBox, settings: PreparationSettings) -> list[str]:
    """Sentences on parameters and causes without effect, and on calibrated parameters that act alike.

    Runs are simulated, the shortest first, until nothing is in doubt.

    Args:
        plant: a plant without findings.
        settings: sizes of the trials and limits.
    """
    every = trials(plant, settings)
    seen = np.zeros(len(every), dtype=bool)
    gram = np.zeros((len(every), len(every)))
    alike = np.zeros(gram.shape, dtype=bool)
    doubtful = np.arange(len(every))
    for run in sorted(range(len(plant.runs)), key=lambda r: len(plant.runs[r].time)):
        changes = _changes(plant, [every[i] for i in doubtful], run)
        seen[doubtful] |= np.max(np.abs(changes), axis=0, initial=0.0) > settings.least_effect
        gram[np.ix_(doubtful, doubtful)] += changes.T @ changes
        alike = _alike(every, gram, settings)
        doubtful = np.flatnonzero(~seen | np.any(alike, axis=1))
        if not len(doubtful):
            return []
    without = [
        f"{every[i].member} has no effect on any trusted reading: check that `outputs` uses it, or "
        "leave "
        "it out"
        for i in np.flatnonzero(~seen)
    ]
    return without + [
        f"{every[i].member} and {every[j].member} act alike on all runs, so that only one number can be "
        "told for both: fix one of them, or make it a tolerance"
        for i, j in np.argwhere(np.triu(alike))
    ]


def _changes(plant: GreyBox, tried: Sequence[Trial], run: int) -> NDArray:
    """Change of the trusted readings of a run by each trial, (values, trials) [channel magnitudes]."""
    values = side_by_side(plant, [{}, *(trial.values for trial in tried)])
    outputs = np.asarray(plant.outputs(values, [run])[0])
    shares = outputs / magnitudes(outputs[..., :1])[:, None, None]
    # A candidate that cannot be simulated shows that the model uses its value.
    changes = np.nan_to_num(shares[..., 1:] - shares[..., :1], nan=1.0)
    return changes[plant.runs[run].trusted]


def _alike(every: Sequence[Trial], gram: NDArray, settings: PreparationSettings) -> NDArray:
    """Pairs of calibrated parameters whose changes correlate, boolean (trials, trials)."""
    size = np.sqrt(np.diag(gram))
    calibrated = np.array([trial.calibrated for trial in every], dtype=bool) & (size > 0)
    correlation = np.abs(gram) / np.maximum(np.outer(size, size), np.finfo(float).tiny)
    pairs = np.outer(calibrated, calibrated) & ~np.eye(len(every), dtype=bool)
    return pairs & (correlation > settings.alike)
