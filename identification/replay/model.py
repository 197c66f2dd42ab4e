"""The model on recorded inputs: every recording and every candidate of the parameters in one batch."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.equations import Inputs
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from identification.replay.drive import Drive

LARGEST_BATCH = 1_500_000
"""Samples times valves that are simulated at once: about 200 MB."""


class Replay:
    """Simulates recordings under candidate parameters."""

    def __init__(self, drives: Sequence[Drive], base: Parameters):
        """base: values of the parameters that the candidates do not change."""
        self.drives = list(drives)
        self.base = base

    def outputs(self, candidates: Mapping[str, NDArray], p2_shift: ArrayLike = 0.0) -> list[NDArray]:
        """Model outputs of n candidates for each recording.

        candidates: values by symbol, shape (n,). p2_shift: added to the recordings' p2 at the start
        [Pa], () or (n,). Returns per recording an array (3, samples, n) of OUTPUTS [Pa, Pa, A]; NaN
        where a candidate cannot be integrated.
        """
        n = max(np.size(value) for value in candidates.values())
        shift = np.broadcast_to(np.asarray(p2_shift, dtype=float), (n,))
        found: list[NDArray] = []
        for group in self._groups(n):
            found += _simulate(group, {**self.base, **candidates}, shift)
        return found

    def _groups(self, n: int) -> list[list[Drive]]:
        """Consecutive recordings that fit into one batch together."""
        groups: list[list[Drive]] = [[]]
        longest = 0
        for drive in self.drives:
            longest = max(longest, len(drive.U))
            if groups[-1] and longest * n * (len(groups[-1]) + 1) > LARGEST_BATCH:
                groups.append([])
                longest = len(drive.U)
            groups[-1].append(drive)
        return groups


def _simulate(drives: list[Drive], p: Mapping[str, ArrayLike], shift: NDArray) -> list[NDArray]:
    """One batch: lane r n + j is candidate j on recording r."""
    n = len(shift)
    tiled = {s: np.tile(value, len(drives)) if np.ndim(value) else value for s, value in p.items()}
    valves = Valves(n * len(drives))
    valves.set_parameters(np.arange(valves.n), tiled)
    p1, U, p2 = (
        np.repeat([getattr(drive, name) for drive in drives], n, axis=0)
        for name in ("p1_start", "U_start", "p2_start")
    )
    initial = energised(tiled, p1=p1, p2=p2 + np.tile(shift, len(drives)), U=U)
    for field, value in zip(valves.state, initial, strict=True):
        field[:] = value
    first = np.stack([valves.state.p2, valves.state.p3, valves.state.I])
    inputs, duration = _inputs(drives)
    every = Inputs(*(np.repeat(field, n, axis=1) for field in inputs))
    later = valves.record(every, np.repeat(duration, n, axis=1))
    outputs = np.concatenate([first[:, None], np.stack([later.p2, later.p3, later.I])], axis=1)
    return [outputs[:, : len(drive.U), r * n : (r + 1) * n] for r, drive in enumerate(drives)]


def _inputs(drives: list[Drive]) -> tuple[Inputs, NDArray]:
    """Inputs, and length of each period; (longest - 1, recordings), 0 past a recording's end."""
    steps = max(len(drive.U) for drive in drives) - 1
    table = np.zeros((5, steps, len(drives)))
    for r, drive in enumerate(drives):
        own = slice(0, len(drive.U) - 1)
        table[0, own, r] = drive.U[:-1]
        table[1, own, r] = drive.sigma_S[:-1]
        table[2, own, r] = np.diff(drive.p1) / drive.period
        table[4, own, r] = drive.period
    return Inputs(*table[:4]), table[4]
