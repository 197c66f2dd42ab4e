"""The controllers by kind: one line each. docs/extending.md says how to add one."""

from controllers import hysteresis, pulse, pwm
from controllers.registration import Registration, RegistrationError

REGISTRY: tuple[Registration, ...] = (
    hysteresis.HYSTERESIS,
    hysteresis.EXTRAPOLATING_HYSTERESIS,
    pwm.REGISTRATION,
    pulse.ADAPTIVE_PULSE,
    pulse.INFORMED_PULSE,
)
"""In the order of the tables."""

TUNED_KINDS = tuple(entry.kind for entry in REGISTRY if entry.search_space is not None)
"""Controllers that are tuned, not trained."""


def registration(kind: str) -> Registration:
    """The record of a controller's kind. Raises RegistrationError if there is none."""
    by_kind = {entry.kind: entry for entry in REGISTRY}
    if kind not in by_kind:
        raise RegistrationError(f"unknown controller {kind!r}: choose one of {', '.join(by_kind)}")
    return by_kind[kind]
