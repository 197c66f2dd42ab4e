"""The registry is complete: a class without a record, or a record without its data, is named."""

import inspect
from collections.abc import Callable, Mapping
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
from controllers.pulse import InformedPulse
from controllers.registration import Choice, Range, Registration, RegistrationError
from controllers.registry import REGISTRY, TUNED_KINDS, registration
from controllers.tuned import (
    ControllersFileError,
    Tuning,
    ablation,
    build,
    load_tunings,
    save_tunings,
    tuned_controllers,
)
from epv_env.plant.plantfile import Plant

UNREGISTERED = {
    Policy: "training writes it into folders, each of which names itself",
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


def unregistered(classes: list[type], registry: tuple[Registration, ...]) -> list[str]:
    """A sentence for each controller class that the registry does not know."""
    known = {entry.controller for entry in registry} | set(UNREGISTERED)
    return [
        f"{each.__module__}.{each.__name__} has no record in controllers/registry.py: write a "
        "Registration beside the class and list it there"
        for each in classes
        if each not in known
    ]


def problems(entry: Registration, tunings: Mapping[str, Tuning]) -> list[str]:
    """A sentence for each thing that a record lacks or contradicts."""
    space = entry.search_space
    if space is not None and entry.kind not in tunings:
        return [
            f"controllers/tuned.json lacks {entry.kind!r}: run `epv tune --only "
            f"{entry.kind!r} --out controllers/tuned.json`"
        ]
    try:
        values = tunings[entry.kind].values if space is not None else {}
        made = entry.built(values, Plant.calibrated())
    except (TypeError, ValueError) as error:
        return [f"{entry.kind!r} cannot be built from its tuned values: {error}"]
    checks: dict[str, Callable[[], bool]] = {
        f"it builds a {type(made).__name__}, not its class": lambda: isinstance(made, entry.controller),
        f"it is called {made.name!r} in tables": lambda: made.name == entry.kind,
        f"its environment {made.environment!r} is not registered": (
            lambda: made.environment in gymnasium.registry
        ),
        "its search space is empty: say None if nothing is tuned": lambda: space is None or bool(space),
    }
    return [f"{entry.kind!r}: {sentence}" for sentence, holds in checks.items() if not holds()]


def test_every_controller_class_is_registered():
    assert unregistered(controller_classes(), REGISTRY) == []


def test_a_class_that_is_not_registered_is_named():
    others = tuple(entry for entry in REGISTRY if entry.controller is not InformedPulse)
    (sentence,) = unregistered(controller_classes(), others)
    assert sentence.startswith(
        "controllers.pulse.InformedPulse has no record in controllers/registry.py"
    )


@pytest.mark.parametrize("entry", REGISTRY, ids=lambda entry: entry.kind)
def test_every_record_is_complete_and_has_its_data(entry):
    assert problems(entry, load_tunings()) == []


def test_kinds_are_unique():
    kinds = [entry.kind for entry in REGISTRY]
    assert sorted(set(kinds)) == sorted(kinds)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"kind": "new"},
            "controllers/tuned.json lacks 'new': run `epv tune --only 'new'",
        ),
        ({"search_space": {"gain": Range(low=0.0, high=1.0)}}, "lacks gain"),
        ({"search_space": {}}, "has unknown open_below, shut_above"),
        (
            {"search_space": dict.fromkeys(("open_below", "shut_above"), Range(low=0.0, high=1.0))},
            "has no meaning: give a number from 0 to 1, or tune anew",
        ),
        ({"build": lambda values, plant: InformedPulse()}, "it builds a InformedPulse"),
        ({"build": lambda values, plant: InformedPulse(**values)}, "cannot be built"),
    ],
)
def test_what_an_incomplete_record_lacks_is_named(changes, words):
    assert words in " ".join(problems(replace(registration("hysteresis"), **changes), load_tunings()))


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
    with pytest.raises(RegistrationError, match=r"inner_time = .*: give a number from 0\.005 to 0\.2"):
        build("PWM", values, Plant.calibrated())
    odd = replace(registration("hysteresis"), search_space={"open_below": Choice(values=(1, 2))})
    with pytest.raises(RegistrationError, match="open_below = 3 has no meaning: give one of 1, 2"):
        odd.built({"open_below": 3}, Plant.calibrated())


def test_classic_controllers_are_tuned_alike_and_come_in_the_tables_order():
    tunings = load_tunings()
    assert tuple(tunings) == TUNED_KINDS
    assert {(tuning.trials, tuning.episodes) for tuning in tunings.values()} == {(100, 128)}
    assert [controller.name for controller in tuned_controllers()] == list(TUNED_KINDS)
    for controller in ablation():
        assert controller.name.removesuffix(", with rules") in TUNED_KINDS


def test_tunings_survive_a_round_trip_and_another_version_is_refused(tmp_path):
    tunings = {"hysteresis": Tuning(values={"open_below": -0.1}, trials=3, mean_return=-1.5, episodes=4)}
    save_tunings(tunings, tmp_path / "t.json", {"seed": 0})
    assert load_tunings(tmp_path / "t.json") == tunings
    (tmp_path / "t.json").write_text('{"format": "epv-controllers/0"}')
    with pytest.raises(ControllersFileError, match="tune anew"):
        load_tunings(tmp_path / "t.json")


@pytest.mark.parametrize(
    "controller", [*tuned_controllers(), *ablation(), load_policy()], ids=lambda each: each.name
)
def test_a_controller_is_printed_in_a_short_line(controller):
    assert "\n" not in repr(controller)
    assert len(repr(controller)) < 1000
