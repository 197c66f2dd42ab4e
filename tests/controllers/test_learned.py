"""The learned policy's network."""

import json

import numpy as np
import pytest

pytest.importorskip("safetensors")
from safetensors.numpy import save_file

from controllers.dense_layer import dense_layer
from controllers.learned import LearnedPolicy, load_policy
from controllers.policy_contract import PolicyError

pytestmark = pytest.mark.training


def layer(rng: np.random.Generator, inputs: int, outputs: int):
    return rng.normal(size=(outputs, inputs)).astype("f4"), rng.normal(size=outputs).astype("f4")


def test_a_layer_is_the_product_of_matrices():
    rng = np.random.default_rng(0)
    (weight, bias), signal = layer(rng, 19, 64), rng.normal(size=(33, 19)).astype("f4")
    np.testing.assert_allclose(dense_layer(signal, weight, bias), signal @ weight.T + bias, atol=1e-5)


@pytest.mark.parametrize("inputs", range(1, 10))
def test_a_layer_adds_its_inputs_in_their_order(inputs):
    """To the bit, as the exported C does; another order rounds otherwise."""
    rng = np.random.default_rng(inputs)
    (weight, bias), signal = layer(rng, inputs, 5), rng.normal(size=(200, inputs)).astype("f4")
    total = np.broadcast_to(bias, (200, 5))
    for i in range(inputs):
        total = total + signal[:, i : i + 1] * weight[:, i]
    np.testing.assert_array_equal(dense_layer(signal, weight, bias), total)
    if inputs > 2:
        other = dense_layer(signal[:, ::-1], weight[:, ::-1], bias)
        assert not np.array_equal(other, total)


def test_a_state_is_decided_the_same_in_every_batch():
    """To the bit: also where the two logits are all but equal."""
    rng = np.random.default_rng(1)
    layers = [layer(rng, 19, 64), layer(rng, 64, 64), layer(rng, 64, 2)]
    states = rng.normal(size=(1000, 19)).astype("f4")
    together, alone, three = (
        np.concatenate([hidden(layers, part) for part in np.split(states, parts)])
        for parts in (1, 1000, 8)
    )
    assert np.array_equal(together, alone)
    assert np.array_equal(together, three)
    policy = LearnedPolicy(layers=layers)
    assert np.array_equal(policy.act(states)[:7], policy.act(states[:7]))


def test_a_policy_without_its_meaning_is_refused(tmp_path):
    save_file({"0.weight": np.zeros((2, 19), "f4")}, tmp_path / "policy.safetensors")
    (tmp_path / "policy.json").write_text(json.dumps({"format": "epv-policy/1", "layers": 1}))
    with pytest.raises(PolicyError, match="field 'environment' is missing"):
        load_policy(tmp_path)


def hidden(layers, states):
    """What the last layer is given."""
    for weight, bias in layers[:-1]:
        states = np.tanh(dense_layer(states, weight, bias))
    return states
