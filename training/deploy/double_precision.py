"""A policy in double precision: the export's reference for calibration and rounding."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from controllers.learned import GatedUnit, LearnedPolicy


def in_double(policy: LearnedPolicy) -> LearnedPolicy:
    """The same policy, computing in double precision."""
    layers = [(weight.astype(np.float64), bias.astype(np.float64)) for weight, bias in policy.layers]
    cell = policy.cell
    if cell is not None:
        cell = GatedUnit(**{name: array.astype(np.float64) for name, array in vars(cell).items()})
    return replace(policy, layers=layers, cell=cell)


def logits_along(policy: LearnedPolicy, observations: NDArray) -> NDArray:
    """Logits (episodes, periods, 2) along observations (episodes, periods, entries)."""
    policy.reset(len(observations))
    return np.stack([policy.logits(observations[:, k]) for k in range(observations.shape[1])], axis=1)


def memory_along(unit: GatedUnit, observations: NDArray) -> NDArray:
    """A unit's memory (episodes, 1 + periods, m) along observations: before the first, after each."""
    memory = [np.zeros((len(observations), unit.width), dtype=unit.weight_input.dtype)]
    for k in range(observations.shape[1]):
        memory.append(unit.step(observations[:, k].astype(memory[0].dtype), memory[-1]))
    return np.stack(memory, axis=1)
