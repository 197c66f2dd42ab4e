"""A policy that stable-baselines3 has saved becomes a policy folder and an export by one command."""

import io
import json
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("onnx")

import torch
from stable_baselines3 import DQN, PPO

from controllers.learned import load_policy
from epv_env.sb3 import make_sb3_env
from tests.training.exports import export
from training.deploy.quantisation import ExportError
from training.deploy.sb3_archive import read_sb3_archive

pytestmark = pytest.mark.training


@pytest.fixture(scope="module")
def env():
    return make_sb3_env("EPValve-v0", num_envs=4)


@pytest.fixture(scope="module")
def saved(env, tmp_path_factory) -> tuple[PPO, Path]:
    """A model that was not trained, with layers of two widths, and its archive."""
    model = PPO(
        "MlpPolicy", env, n_steps=8, batch_size=16, seed=1, policy_kwargs={"net_arch": {"pi": [24, 12]}}
    )
    path = tmp_path_factory.mktemp("sb3") / "model.zip"
    model.save(path)
    return model, path


def changed(path: Path, to: Path, part: str, content: bytes) -> Path:
    """A copy of an archive with one part replaced; empty content leaves the part out."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(to, "w") as new:
        for name in old.namelist():
            if name != part or content:
                new.writestr(name, content if name == part else old.read(name))
    return to


def test_the_policy_decides_as_the_model(saved):
    model, path = saved
    policy, _ = read_sb3_archive(path)
    observations = np.random.default_rng(2).normal(size=(500, 13)).astype(np.float32)
    wanted, _ = model.predict(observations, deterministic=True)
    policy.reset(500)
    np.testing.assert_array_equal(policy.act(observations), wanted)


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here")
def test_one_command_makes_a_policy_folder_and_c_and_onnx(saved, tmp_path):
    _, path = saved
    assert export(path, tmp_path / "ecu") == 0
    names = {each.name for each in (tmp_path / "ecu").iterdir()}
    assert {"policy.json", "policy.safetensors", "policy.onnx", "epv_float.c", "epv_fixed.c"} <= names
    folder = load_policy(tmp_path / "ecu")
    direct, _ = read_sb3_archive(path)
    for (a, b), (c, d) in zip(folder.layers, direct.layers, strict=True):
        np.testing.assert_array_equal(a, c)
        np.testing.assert_array_equal(b, d)
    assert export(path, tmp_path / "ecu") == 0  # an earlier one is replaced


def test_a_trained_policys_folder_is_left_alone(saved, tmp_path):
    (tmp_path / "policy.json").write_text("{}")
    assert export(saved[1], tmp_path) == 2
    assert (tmp_path / "policy.json").read_text() == "{}"


def test_another_activation_is_refused(env, tmp_path):
    kwargs = {"activation_fn": torch.nn.ReLU}
    PPO("MlpPolicy", env, n_steps=8, batch_size=16, policy_kwargs=kwargs).save(tmp_path / "relu.zip")
    with pytest.raises(ExportError, match=r"ReLU.*not tanh"):
        read_sb3_archive(tmp_path / "relu.zip")


def test_another_algorithm_is_refused(env, tmp_path, capsys):
    DQN("MlpPolicy", env).save(tmp_path / "dqn.zip")
    assert export(tmp_path / "dqn.zip", tmp_path / "ecu") == 2
    assert "not a plain multilayer perceptron (it has q_net" in capsys.readouterr().err
    assert not (tmp_path / "ecu").exists()


class Trap:
    """Raises where it is unpickled."""

    def __reduce__(self):
        return exec, ("raise SystemExit('code of the archive ran')",)


def pickled(value: object) -> bytes:
    stream = io.BytesIO()
    torch.save(value, stream)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("part", "content", "sentence"),
    [
        ("policy.pth", b"", "cannot read"),
        ("policy.pth", b"torn", "cannot read"),
        ("policy.pth", pickled({"x": Trap()}), "cannot read"),
        ("policy.pth", pickled({1: torch.zeros(2)}), "it has 1"),
        ("policy.pth", pickled([1]), "it lacks action_net.weight"),
        (
            "policy.pth",
            pickled({"action_net.weight": torch.zeros(2, 9), "action_net.bias": torch.zeros(2)}),
            "a layer of shape",
        ),
        ("data", b"", "cannot read"),
        ("data", b"{", "cannot read"),
        ("data", b"[" * 100_000, "cannot read"),
        ("data", b"[]", "not tanh"),
        ("data", json.dumps({"policy_kwargs": {"activation_fn": 3}}).encode(), "activation 3"),
    ],
)
def test_a_damaged_archive_is_refused_in_a_sentence(saved, tmp_path, part, content, sentence):
    path = changed(saved[1], tmp_path / "model.zip", part, content)
    with pytest.raises(ExportError, match=sentence):
        read_sb3_archive(path)


def test_a_file_that_is_no_archive_is_refused(tmp_path):
    (tmp_path / "model.zip").write_text("no archive")
    with pytest.raises(ExportError, match=r"give what model\.save wrote"):
        read_sb3_archive(tmp_path / "model.zip")
    with pytest.raises(ExportError, match=r"give what model\.save wrote"):
        read_sb3_archive(tmp_path / "missing.zip")
