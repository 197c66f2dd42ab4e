"""The registry is complete: a class without a record, or a record without its data, is named."""

import inspect
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import gymnasium
import pytest

pytest.importorskip("control")

import controllers
import epv_env  # noqa: F401 - registers the environments
from controllers.knowledge import WithRules
from controllers.policy import Policy, load_policy
from controllers.pulse import _Pulse
from controllers.registration import Choice, RegistrationError
from controllers.registry import REGISTRY, TUNED_KINDS, registration
from controllers.tuned import ControllersFileError, Tuning, build, load_tunings, save_tunings, tuned
from epv_env.plant.plantfile import Plant

UNREGISTERED = {
    Policy: "training writes it into folders, each of which names itself",
    _Pulse: "what the two pulse controllers share",
    WithRules: "worn around a controller, which has a record of its own",
}
"""Controllers that the registry does not list, each with the reason."""


def controller_classes() -> list[type]:
    """Every class in the folder `controllers` that has the protocol's methods."""
    modules = [
        import_module(f"controllers.{path.stem}")
        for path in sorted(Path(controllers.__file__).parent.glob("*.py"))
        if path.stem not in ("__init__", "base")
    ]
    return [
        each
        for module in modules
        for each in vars(module).values()
        if inspect.isclass(each) and each.__module__ == module.__name__
        if callable(getattr(each, "act", None)) and callable(getattr(each, "reset", None))
    ]


def test_every_controller_class_is_registered():
    known = {entry.controller for entry in REGISTRY} | set(UNREGISTERED)
    assert set(controller_classes()) <= known, "write a Registration beside the class and list it"


@pytest.mark.parametrize("entry", REGISTRY, ids=lambda entry: entry.kind)
def test_every_record_is_complete_and_has_its_data(entry):
    tuned = entry.search_space is not None
    made = entry.built(load_tunings()[entry.kind].values if tuned else {}, Plant.calibrated())
    assert isinstance(made, entry.controller)
    assert made.name == entry.kind
    assert made.environment in gymnasium.registry
    assert entry.search_space is None or entry.search_space


def test_an_unknown_kind_and_a_forgotten_value_get_one_sentence():
    with pytest.raises(
        RegistrationError, match="unknown controller 'fuzzy': choose one of hysteresis, "
    ):
        build("fuzzy", {}, Plant.calibrated())
    with pytest.raises(RegistrationError, match=r"'hysteresis' lacks shut_above: .* tune anew"):
        build("hysteresis", {"open_below": -0.1}, Plant.calibrated())


@pytest.mark.parametrize("value", [-0.0, 0.0, float("nan"), 1e300])
def test_a_value_without_meaning_gets_one_sentence(value):
    values = {**load_tunings()["PWM"].values, "inner_time": value}
    with pytest.raises(RegistrationError, match=r"inner_time = .*: give a number from 0\.005 to 0\.06"):
        build("PWM", values, Plant.calibrated())
    odd = replace(registration("hysteresis"), search_space={"open_below": Choice(values=(1, 2))})
    with pytest.raises(RegistrationError, match="open_below = 3 is not allowed: give one of 1, 2"):
        odd.built({"open_below": 3}, Plant.calibrated())


def test_classic_controllers_are_tuned_alike_and_come_in_the_tables_order():
    tunings = load_tunings()
    assert tuple(tunings) == TUNED_KINDS
    assert {(tuning.trials, tuning.episodes) for tuning in tunings.values()} == {(100, 128)}
    assert [tuned(kind).name for kind in load_tunings()] == list(TUNED_KINDS)


def test_tunings_survive_a_round_trip_and_another_version_is_refused(tmp_path):
    tunings = {"hysteresis": Tuning(values={"open_below": -0.1}, trials=3, mean_return=-1.5, episodes=4)}
    save_tunings(tunings, tmp_path / "t.json", {"seed": 0})
    assert load_tunings(tmp_path / "t.json") == tunings
    (tmp_path / "t.json").write_text('{"format": "epv-controllers/0"}')
    with pytest.raises(ControllersFileError, match="tune anew"):
        load_tunings(tmp_path / "t.json")


def test_a_controller_is_printed_in_a_short_line():
    for controller in (*map(tuned, TUNED_KINDS), tuned("adaptive pulse with rules"), load_policy()):
        assert "\n" not in repr(controller)
        assert len(repr(controller)) < 1000
