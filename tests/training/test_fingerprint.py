"""Results of former code or settings are not taken for those of a controller."""

from dataclasses import replace
from pathlib import Path

import pytest

from controllers.hysteresis import Hysteresis
from controllers.supervised import supervised
from epv_env.plant.plantfile import Plant
from training.studies.fingerprint import _sources, fingerprint

PLAIN = Hysteresis(open_below=-0.1, shut_above=0.0)


def names(controller):
    return {Path(source).stem for source in _sources(controller)}


def test_settings_count():
    assert fingerprint(PLAIN) == fingerprint(replace(PLAIN))
    assert fingerprint(PLAIN) != fingerprint(replace(PLAIN, shut_above=0.01))


def test_the_code_of_all_parts_counts():
    """The parts of a supervised controller, and the functions that these call."""
    parts = {"p3_check", "supervisor", "governor", "valve_learner", "opening_bank", "reserve"}
    assert parts | {"hysteresis"} <= names(supervised(PLAIN, Plant.calibrated()))
    assert not {"mpc", "oracle"} & names(supervised(PLAIN, Plant.calibrated()))
    assert not parts & names(PLAIN)


@pytest.mark.parametrize("module", ["governor", "reserve"])
def test_a_change_of_a_part_is_seen(module, monkeypatch):
    controller = supervised(PLAIN, Plant.calibrated())
    before, read = fingerprint(controller), Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path.stem == module))
    assert fingerprint(controller) != before


def test_a_controller_of_ones_own_counts_with_what_it_imports(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(
        "from controllers.hysteresis import Hysteresis\n\n\nclass Mine(Hysteresis):\n    pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    mine = __import__("mine").Mine(open_below=-0.1, shut_above=0.0)
    assert {"mine", "hysteresis"} <= names(mine)
