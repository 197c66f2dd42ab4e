"""A policy in integers: int8 weights with a scale for each row, int16 observations and activations.

Rounding to nearest, after Jacob et al., Quantization and Training of Neural Networks for Efficient
Integer-Arithmetic-Only Inference, CVPR 2018, section 2; the biases are corrected for the mean error that
the rounding causes on visited states (Nagel et al., Data-Free Quantization, ICCV 2019, section 4.2).
A gated recurrent unit is quantised as two layers, of the observation and of the cells; what the cells
carry on has 32 bits, or a memory that fades slowly would be lost to rounding.

Decision 2026-11-21: activations have 16 bits, not 8: they take a few hundred bytes of memory while a
decision lasts, and a 16-bit multiplication costs such processors no more than one of 8 bits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.learned import GatedUnit, LearnedPolicy
from epv_env.observation import LAYOUT
from training.deploy.double_precision import in_double, memory_along
from training.deploy.settings import SETTINGS, ExportSettings

SIGNAL_ONE = 2**15 - 1
"""What stands for an entry's reach, and for 1 in the activations."""
SUM_ONE = 2**16
"""What stands for 1 in the sums that tanh is taken of, and in the logits."""
GATE_ONE = 2**15
"""What stands for 1 in the gates of a recurrent unit; SIGNAL_ONE * GATE_ONE does in its cells."""
MOST_ROW_INPUTS = 2**31 // (2**7 * 2**15)
"""Inputs of a row, at most: its sum must fit 32 bits."""
LARGEST_EXACT_SUM = 2**30
"""What the exact weights' sums may reach; as much again is left for their rounding."""

UNITS = {"bar": ("Pa", 1e5), "A": ("uA", 1e6), "s": ("us", 1e6), "1": ("1/1000", 1e3)}
"""Unit of each whole number by the observation's unit, and how many of it make one."""


class ExportError(ValueError):
    """A policy cannot be exported: the message says why and what to do."""


@dataclass(frozen=True, kw_only=True)
class FixedLayer:
    """Row j of a layer: (weight[j] · signal) · factor[j] / 2^shift + bias[j], SUM_ONE standing for 1."""

    weight: NDArray
    """(outputs, inputs) int8"""
    factor: NDArray
    """(outputs,) uint32"""
    shift: int
    bias: NDArray
    """(outputs,) int32"""


@dataclass(frozen=True, kw_only=True)
class FixedInput:
    """How an entry becomes int16: (value - centre) limited to ±reach, times factor / 2^shift."""

    centre: NDArray
    """(entries,) int32, in UNITS"""
    reach: NDArray
    """(entries,) int32, in UNITS"""
    factor: NDArray
    """(entries,) uint32"""
    shift: int
    amplitude: NDArray
    """(entries,) the reach in the observation's own scaling"""


@dataclass(frozen=True, kw_only=True)
class FixedUnit:
    """A gated recurrent unit: rows of the reset gate, the update gate and the candidate, m each."""

    of_observation: FixedLayer
    """Of the observation."""
    of_cells: FixedLayer
    """Of the cells, rounded to int16."""


@dataclass(frozen=True, kw_only=True)
class FixedPolicy:
    """Everything that epv_fixed.c holds as data."""

    inputs: FixedInput
    cell: FixedUnit | None
    layers: list[FixedLayer]
    tangent: NDArray
    """(257,) int16: tanh of multiples of 1/32, SIGNAL_ONE standing for 1"""


def quantise(
    policy: LearnedPolicy, observations: NDArray, *, settings: ExportSettings = SETTINGS
) -> FixedPolicy:
    """A policy in integers, calibrated on visited observations (episodes, periods, entries).

    Raises ExportError if its sums could leave 32 bits.
    """
    precise = in_double(policy)
    exact = observations.reshape(-1, observations.shape[-1]).astype(np.float64)
    inputs = _inputs(exact, settings.input_headroom)
    reach = inputs.amplitude
    signal = np.clip(_rounded(exact / reach), -1, 1)
    cell = None
    if precise.cell is not None:
        memory = memory_along(precise.cell, observations)
        before, after = (part.reshape(-1, policy.cells) for part in (memory[:, :-1], memory[:, 1:]))
        cell = _unit(precise.cell, exact, signal, reach, before)
        exact = np.concatenate([exact, after], axis=1)
        signal = np.concatenate([signal, _rounded(after)], axis=1)
        reach = np.concatenate([reach, np.ones(policy.cells)])
    layers = []
    for number, (weight, bias) in enumerate(precise.layers):
        wanted = exact @ weight.T + bias
        layer, rounded = _layer(weight * reach, wanted, signal, f"layer {number}", LARGEST_EXACT_SUM)
        layers.append(layer)
        exact, signal, reach = np.tanh(wanted), _rounded(np.tanh(rounded)), 1.0
    tangent = np.rint(SIGNAL_ONE * np.tanh(np.arange(257) / 32)).astype(np.int16)
    return FixedPolicy(inputs=inputs, cell=cell, layers=layers, tangent=tangent)


def _rounded(signal: NDArray) -> NDArray:
    """The values that int16 keeps of a signal of any shape, 1 standing for its reach."""
    return np.rint(signal * SIGNAL_ONE) / SIGNAL_ONE


def _inputs(observations: NDArray, headroom: float) -> FixedInput:
    """How entries of observations (n, entries) become int16; headroom: beyond the farthest seen [1]."""
    limit = np.array([quantity.limit for quantity in LAYOUT])
    seen = np.abs(observations).max(axis=0)
    amplitude = np.minimum(np.where(seen > 0, headroom * seen, limit), limit)
    units = np.array([UNITS[quantity.unit][1] for quantity in LAYOUT])
    scale = np.array([quantity.scale for quantity in LAYOUT])
    centre = np.rint(units * np.array([quantity.centre for quantity in LAYOUT]))
    reach = np.maximum(np.rint(amplitude * scale * units), 1.0)
    factor, shift = _factors(SIGNAL_ONE / reach)
    return FixedInput(
        centre=centre.astype(np.int32), reach=reach.astype(np.int32), factor=factor, shift=shift,
        amplitude=reach / (scale * units),
    )  # fmt: skip


def _unit(
    unit: GatedUnit, observations: NDArray, signal: NDArray, reach: NDArray, memory: NDArray
) -> FixedUnit:
    """Its two layers; memory: (n, m) what it holds exactly when the observations (n, entries) come.

    signal: what int16 keeps of the observations, 1 standing for their reach.
    """
    new_wanted = observations @ unit.weight_input.T + unit.bias_input
    old_wanted = memory @ unit.weight_memory.T + unit.bias_memory
    largest = LARGEST_EXACT_SUM // 2  # a gate adds the two
    new, _ = _layer(unit.weight_input * reach, new_wanted, signal, "the recurrent unit", largest)
    old, _ = _layer(unit.weight_memory, old_wanted, _rounded(memory), "the recurrent unit", largest)
    return FixedUnit(of_observation=new, of_cells=old)


def _layer(
    weight: NDArray, wanted: NDArray, signal: NDArray, place: str, largest_sum: int
) -> tuple[FixedLayer, NDArray]:
    """One layer, and what it gives (n, outputs) for signals (n, inputs) where `wanted` is exact."""
    largest = np.abs(weight).max(axis=1)
    step = np.where(largest > 0, largest / 127, 1.0)
    rounded = np.rint(weight / step[:, None])
    sums = signal @ (rounded * step[:, None]).T
    bias = np.rint((wanted - sums).mean(axis=0) * SUM_ONE)
    reached = np.abs(weight).sum(axis=1) * SUM_ONE + np.abs(bias)
    if weight.shape[1] > MOST_ROW_INPUTS or np.any(reached > largest_sum):
        raise ExportError(
            f"{place} of the policy is too wide or too steep for sums of 32 bits: train one with "
            f"at most {MOST_ROW_INPUTS} inputs to a layer and smaller weights"
        )
    factor, shift = _factors(step * SUM_ONE / SIGNAL_ONE)
    layer = FixedLayer(
        weight=rounded.astype(np.int8), factor=factor, shift=shift, bias=bias.astype(np.int32)
    )
    return layer, sums + bias / SUM_ONE


def _factors(ratios: NDArray) -> tuple[NDArray, int]:
    """Whole numbers (n,) below 2^31 and one shift, so that factor / 2^shift is each ratio (n,)."""
    shift = min(30 - int(np.floor(np.log2(ratios.max()))), 62)
    return np.rint(ratios * 2.0**shift).clip(max=2**31 - 1).astype(np.uint32), shift
