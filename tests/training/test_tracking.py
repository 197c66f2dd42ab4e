"""Weights & Biases as an option: a run for each training, a sentence where the package is missing."""

import sys
from types import SimpleNamespace

import pytest

pytest.importorskip("stable_baselines3")

from training import train_ppo
from training.learners.tracking import PROJECT, tracked

pytestmark = pytest.mark.training


class ServiceError(Exception):
    """What the package raises."""


class Package(SimpleNamespace):
    """Stands for the package wandb, and notes the calls that it gets."""

    def __init__(self, refuses=False):
        super().__init__(Error=ServiceError, calls=[], refuses=refuses)
        self.tensorboard = SimpleNamespace(
            patch=lambda root_logdir: self.calls.append(("patch", root_logdir)),
            unpatch=lambda: self.calls.append(("unpatch",)),
        )

    def init(self, **settings):
        if self.refuses:
            raise ServiceError("no key")
        self.calls.append(("init", settings))
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.calls.append(("finish",))


@pytest.fixture
def package(monkeypatch):
    monkeypatch.delenv("WANDB_PROJECT", raising=False)
    stub = Package()
    monkeypatch.setitem(sys.modules, "wandb", stub)
    return stub


def names(package):
    return [call[0] for call in package.calls]


def test_a_run_begins_before_the_work_and_ends_after_it(package, tmp_path):
    with tracked(True, name="a", folder=tmp_path, config={"seed": 1}):
        package.calls.append(("work",))
    assert names(package) == ["patch", "init", "work", "finish", "unpatch"]
    assert package.calls[0][1] == str(tmp_path)
    assert package.calls[1][1] == {
        "name": "a", "dir": str(tmp_path), "config": {"seed": 1}, "project": PROJECT,
    }  # fmt: skip


def test_a_run_ends_when_the_work_fails(package, tmp_path):
    with pytest.raises(OSError), tracked(True, name="a", folder=tmp_path, config={}):  # noqa: PT011
        raise OSError
    assert names(package) == ["patch", "init", "finish", "unpatch"]


def test_the_users_project_counts(package, tmp_path, monkeypatch):
    monkeypatch.setenv("WANDB_PROJECT", "mine")
    with tracked(True, name="a", folder=tmp_path, config={}):
        pass
    assert "project" not in package.calls[1][1]


def test_a_refusal_of_the_service_is_a_sentence(package, tmp_path):
    package.refuses = True
    with (
        pytest.raises(ValueError, match=r"\(no key\): call `wandb login`, or set WANDB_MODE=offline"),
        tracked(True, name="a", folder=tmp_path, config={}),
    ):
        pass
    assert names(package) == ["patch", "unpatch"]


def test_nothing_is_tracked_unless_it_is_asked_for(package, tmp_path):
    with tracked(False, name="a", folder=tmp_path, config={}):
        pass
    assert package.calls == []


@pytest.mark.parametrize("command", [train_ppo])
def test_a_command_without_the_package_names_it_and_writes_nothing(command, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(ValueError, match=r"--track needs the package wandb.*pip install wandb"):
        command.main(["--quick", "--track", "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()
