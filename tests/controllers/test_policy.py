"""The learned policy: its network, its files, and the policy that comes with the package."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("safetensors")
from safetensors.numpy import load_file, save_file

from controllers.knowledge import INPUTS
from controllers.network import Network
from controllers.policy import TRAINED, load_policy
from controllers.policy_files import CONTRACT_FILE, WEIGHTS_FILE, PolicyError, read_policy, write_policy
from controllers.valve_learner import LEARNT
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training


def layer(rng: np.random.Generator, inputs: int, outputs: int):
    return rng.normal(size=(outputs, inputs)).astype("f4"), rng.normal(size=outputs).astype("f4")


def network(seed: int = 0) -> Network:
    rng = np.random.default_rng(seed)
    layers = [layer(rng, INPUTS, 16), layer(rng, 16, 16), layer(rng, 16, 2)]
    return Network(layers=layers, advice_weight=np.array([-0.5, 0.5], "f4"))


def test_a_layer_adds_its_inputs_in_their_order():
    """Up to the rounding of tanh, as exported C does; another order rounds otherwise."""
    net, signal = network(), np.random.default_rng(1).normal(size=(200, INPUTS)).astype("f4")
    out = signal
    for k, (weight, bias) in enumerate(net.layers):
        total = np.broadcast_to(bias, (200, len(bias)))
        for i in range(out.shape[1]):
            total = total + out[:, i : i + 1] * weight[:, i]
        out = total if k == len(net.layers) - 1 else np.tanh(total)
    np.testing.assert_allclose(net.logits(signal), out + signal[:, -1:] * net.advice_weight, atol=1e-4)


def test_a_state_is_decided_the_same_in_every_batch_and_the_advice_counts():
    inputs, net = np.random.default_rng(1).normal(size=(300, INPUTS)).astype("f4"), network()
    alone = np.concatenate([net.logits(row[None]) for row in inputs])
    assert np.array_equal(net.logits(inputs), alone)
    inputs[:, -1] = np.sign(inputs[:, -1])
    advised = replace(net, advice_weight=np.array([-999.0, 999.0], "f4")).logits(inputs)
    assert np.array_equal(np.argmax(advised, axis=1), (inputs[:, -1] > 0).astype(int))


def test_a_policy_is_read_as_it_was_written(tmp_path):
    write_policy(network(), tmp_path, control_period=5e-3, provenance={"seed": 3})
    contract, read = read_policy(tmp_path)
    assert contract.provenance == {"seed": 3}
    assert [entry["name"] for entry in contract.learnt] == [entry.name for entry in LEARNT]
    inputs = np.random.default_rng(2).normal(size=(50, INPUTS)).astype("f4")
    assert np.array_equal(read.logits(inputs), network().logits(inputs))


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda content: content["observation"]["entries"].reverse(), "other observations"),
        (lambda content: content["learnt"].pop(), "other observations"),
        (lambda content: content.pop("layers"), "field 'layers' is missing"),
        (lambda content: content.update(layers=4), "lacks the array '3.weight'"),
    ],
)
def test_a_contract_that_does_not_fit_is_refused(tmp_path, damage, words):
    write_policy(network(), tmp_path, control_period=5e-3, provenance={})
    content = json.loads((tmp_path / CONTRACT_FILE).read_text())
    damage(content)
    (tmp_path / CONTRACT_FILE).write_text(json.dumps(content))
    with pytest.raises(PolicyError, match=words):
        read_policy(tmp_path)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"0.weight": np.zeros((16, 5), "f4")}, "has shape"),
        ({"0.bias": np.full(16, np.nan, "f4")}, "not finite"),
        ({"0.bias": np.zeros(16, "f8")}, "has type float64"),
        ({"0.weight": np.zeros((0, INPUTS), "f4"), "0.bias": np.zeros(0, "f4")}, "has shape"),
    ],
)
def test_weights_that_do_not_fit_are_refused(tmp_path, changes, words):
    write_policy(network(), tmp_path, control_period=5e-3, provenance={})
    save_file({**load_file(tmp_path / WEIGHTS_FILE), **changes}, tmp_path / WEIGHTS_FILE)
    with pytest.raises(PolicyError, match=words):
        read_policy(tmp_path)
    unknown = b'{"0.bias": {"dtype": "BF16", "shape": [16], "data_offsets": [0, 32]}}'
    for content in (b"no weights", len(unknown).to_bytes(8, "little") + unknown + bytes(32)):
        (tmp_path / WEIGHTS_FILE).write_bytes(content)
        with pytest.raises(PolicyError, match="cannot read a policy"):
            read_policy(tmp_path)


@pytest.mark.parametrize("folder", [None, True, b"x", []])
def test_what_is_no_path_is_refused(folder):
    with pytest.raises(PolicyError, match="give the path of a folder"):
        load_policy(folder)


def test_the_package_holds_one_policy_which_holds_the_band_on_unknown_valves():
    files = {path.name for path in TRAINED.iterdir()}
    assert files == {CONTRACT_FILE, WEIGHTS_FILE}
    options = {"parameters": "sensitive_ten_percent"}
    metrics = run_episodes(load_policy(), seeds=list(range(64)), duration=5.0, options=options)
    assert metrics.stayed.mean() > 0.98
    assert metrics.rms_bar.mean() < 0.12
