"""The controllers by kind: one line each. docs/extending.md says how to add one."""

from controllers import (
    adaptive_cascade,
    adaptive_hysteresis,
    adaptive_mpc,
    adaptive_pulse,
    hysteresis,
    mpc,
    oracle,
    privileged_pulse,
    pulse,
    pwm,
)
from controllers.base import Controller
from controllers.registration import CHEAP, CostClass, Registration, RegistrationError
from epv_env.plant.plantfile import Plant

REGISTRY: tuple[Registration, ...] = (
    hysteresis.HYSTERESIS,
    hysteresis.EXTRAPOLATING_HYSTERESIS,
    adaptive_hysteresis.REGISTRATION,
    pwm.REGISTRATION,
    adaptive_cascade.REGISTRATION,
    pulse.REGISTRATION,
    adaptive_pulse.REGISTRATION,
    mpc.REGISTRATION,
    adaptive_mpc.REGISTRATION,
    privileged_pulse.REGISTRATION,
    oracle.REGISTRATION,
)
"""In the order of the tables."""


WITH_MARGIN = ", with margin"
"""Follows the kind in the name of a controller that was tuned under training's stricter objective."""


def kind_of(name: str) -> str:
    """The kind of a controller by its name in tables and in controllers/tuned.json."""
    return name.removesuffix(WITH_MARGIN)


def registration(name: str) -> Registration:
    """The record of a controller's kind. Raises RegistrationError if there is none."""
    by_kind, kind = {entry.kind: entry for entry in REGISTRY}, kind_of(name)
    if kind not in by_kind:
        raise RegistrationError(f"unknown controller {kind!r}: choose one of {', '.join(by_kind)}")
    return by_kind[kind]


def cost_class(name: str) -> CostClass:
    """The cost class of a controller by its name in tables; a learned policy is cheap."""
    return next((entry.cost for entry in REGISTRY if entry.kind == kind_of(name)), CHEAP)


def untuned_controllers(plant: Plant) -> list[Controller]:
    """The registered controllers that have nothing to tune: those that see what no ECU measures."""
    return [entry.built({}, plant) for entry in REGISTRY if entry.search_space is None]


TUNED_KINDS = tuple(entry.kind for entry in REGISTRY if entry.search_space is not None)
"""Controllers that are tuned, not trained."""

SIMULATING_KINDS = tuple(kind for kind in TUNED_KINDS if cost_class(kind).simulates_plant)
"""Tuned controllers that simulate the plant as they decide."""
