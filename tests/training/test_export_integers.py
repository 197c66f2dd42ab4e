"""The integer code is the arithmetic that the guide describes, to the last bit."""

import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("safetensors")

from controllers.learned import GatedUnit, LearnedPolicy, load_policy
from epv_env.observation import INDEX, LAYOUT
from tests.training.exports import EPISODES, PERIODS, copied, export_of, recurrent_export
from tests.training.policies import random_layers
from training.deploy.c_sources import Export, sources
from training.deploy.compiled_export import library, memory_type
from training.deploy.double_precision import in_double, memory_along
from training.deploy.quantisation import GATE_ONE, SIGNAL_ONE, FixedLayer, FixedPolicy, quantise
from training.deploy.visited_states import visit
from training.evaluation.seeds import CALIBRATION_SEED

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]


def compiled_logits(folder: Path, signal: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """Logits (episodes, periods, 2) of the code in a folder along int16 observations.

    memory: (episodes,) C structures, which remember it.
    """
    code = library(["cc"], folder)
    given = np.ascontiguousarray(signal)
    logits = np.empty((*given.shape[:2], 2), dtype=np.int32)
    for e, k in np.ndindex(given.shape[:2]):
        code.epv_fixed_logits(memory[e:].ctypes, given[e, k].ctypes, logits[e, k].ctypes)
    return logits


def whole_number_logits(fixed: FixedPolicy, signal: np.ndarray) -> np.ndarray:
    """Logits (episodes, periods, 2) along observations, int16, in 64-bit whole numbers."""
    memory = np.zeros(
        (len(signal), 0 if fixed.cell is None else len(fixed.cell.of_observation.bias) // 3), np.int64
    )
    logits = []
    for observation in signal.swapaxes(0, 1).astype(np.int64):
        memory = next_memory(fixed, observation, memory)
        wide = np.concatenate([observation, shifted(memory, 1, 15)], axis=1)
        for layer in fixed.layers[:-1]:
            wide = tangent(fixed, rows(layer, wide))
        logits.append(rows(fixed.layers[-1], wide))
    return np.stack(logits, axis=1)


def next_memory(fixed: FixedPolicy, observation: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """(n, cells), SIGNAL_ONE * GATE_ONE standing for 1."""
    if fixed.cell is None:
        return memory
    new = np.split(rows(fixed.cell.of_observation, observation), 3, axis=1)
    old = np.split(rows(fixed.cell.of_cells, shifted(memory, 1, 15)), 3, axis=1)
    reset, update = (gate(fixed, inside(a + b)) for a, b in zip(new[:2], old[:2], strict=True))
    candidate = tangent(fixed, inside(new[2] + shifted(old[2], reset, 15)))
    return inside((GATE_ONE - update) * candidate + shifted(memory, update, 15))


def inside(sums: np.ndarray) -> np.ndarray:
    """The same, if 32 bits hold it."""
    assert np.abs(sums).max() < 2**31
    return sums


def shifted(value: np.ndarray, factor: np.ndarray | int, shift: int) -> np.ndarray:
    """value factor / 2^shift, halves away from zero."""
    return np.sign(value) * ((np.abs(value) * factor + (1 << (shift - 1))) >> shift)


def rows(layer: FixedLayer, signal: np.ndarray) -> np.ndarray:
    sums = inside(signal @ layer.weight.T.astype(np.int64))
    return inside(shifted(sums, layer.factor.astype(np.int64), layer.shift) + layer.bias)


def tangent(fixed: FixedPolicy, x: np.ndarray) -> np.ndarray:
    table = fixed.tangent.astype(np.int64)
    size = np.minimum(np.abs(x), (256 << 11) - 1)
    place, part = size >> 11, size & 2047
    between = table[place] + (((table[place + 1] - table[place]) * part + 1024) >> 11)
    return np.sign(x) * np.where(np.abs(x) >= 256 << 11, SIGNAL_ONE, between)


def gate(fixed: FixedPolicy, x: np.ndarray) -> np.ndarray:
    return (GATE_ONE + tangent(fixed, np.sign(x) * (np.abs(x) // 2)) + 1) >> 1


def random_export(folder: Path) -> tuple[Path, Path]:
    return export_of(random_layers(seed=2), folder)


@pytest.mark.parametrize("make", [random_export, recurrent_export])
def test_the_integer_code_is_the_arithmetic_that_is_documented(make, tmp_path):
    """The same whole numbers from numpy, for every state, to the last bit."""
    folder, out = make(tmp_path)
    policy = load_policy(folder)
    seen = visit(policy, first_seed=CALIBRATION_SEED, episodes=EPISODES, periods=PERIODS)
    fixed = quantise(policy, seen.observations)
    given = (
        np.random.default_rng(0)
        .integers(-SIGNAL_ONE, SIGNAL_ONE, (20, 100, 13), endpoint=True)
        .astype(np.int16)
    )
    memory = np.zeros(len(given), memory_type("fixed", policy.cells))
    logits = compiled_logits(copied(out, tmp_path), given, memory)
    np.testing.assert_array_equal(logits, whole_number_logits(fixed, given))


def test_a_memory_that_fades_slowly_is_not_lost_to_rounding(tmp_path):
    """One cell that takes in a thousandth of tanh(p2_error / 2) in each period."""
    row, none = np.zeros((1, len(LAYOUT)), np.float32), np.zeros((1, len(LAYOUT)), np.float32)
    row[0, INDEX["p2_error"]] = 0.5
    unit = GatedUnit(
        weight_input=np.concatenate([none, none, row]),
        weight_memory=np.zeros((3, 1), np.float32),
        bias_input=np.array([0, 7, 0], np.float32),
        bias_memory=np.zeros(3, np.float32),
    )
    last = np.zeros((2, len(LAYOUT) + 1), np.float32)
    last[1, -1] = 1.0
    policy = LearnedPolicy(layers=[(last, np.zeros(2, np.float32))], cell=unit)
    observed = np.zeros((1, 1000, len(LAYOUT)), np.float32)
    observed[..., INDEX["p2_error"]] = 0.04
    fixed = quantise(policy, observed)
    export = Export(policy=policy, fixed=fixed, period=0.005, weights_sha256="none")
    for name, text in sources(export).items():
        (tmp_path / name).write_text(text)
    memory = np.zeros(1, memory_type("fixed", 1))
    compiled_logits(
        tmp_path, np.rint(observed / fixed.inputs.amplitude * SIGNAL_ONE).astype(np.int16), memory
    )
    precise = in_double(policy).cell
    assert precise is not None
    wanted = memory_along(precise, observed)[0, -1]
    np.testing.assert_allclose(memory["cell"][0] / (SIGNAL_ONE * GATE_ONE), wanted, rtol=0.03)
