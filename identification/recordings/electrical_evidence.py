"""What the coil's physics contradicts: the holding current against U/R, and a coil that is off."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from identification.recordings.rules import RULES, RecordingRules


def energised_samples(U: NDArray, rules: RecordingRules = RULES) -> NDArray:
    """Whether the coil is on, boolean like `U` (samples,) [V]: above half the greatest voltage."""
    greatest = float(np.max(U))
    return (0.5 * greatest < U) & (greatest > rules.least_voltage)


def starting_state(energised: NDArray) -> slice:
    """Samples before the coil, boolean (samples,), first switches."""
    changes = np.flatnonzero(np.diff(energised))
    return slice(0, int(changes[0]) + 1 if changes.size else len(energised))


def electrical_contradictions(
    signals: Mapping[str, NDArray], period: float, rules: RecordingRules = RULES
) -> Iterator[str]:
    """Sentences on what voltage and current cannot be; none if physics allows them.

    signals: U [V] and I [A], each (samples,). period [s].
    """
    U, current = signals["U"], signals["I"]
    energised = energised_samples(U, rules)
    start = starting_state(energised)
    if energised[0]:
        yield from _holding(float(np.median(U[start])), float(np.median(current[start])), rules)
        yield from _after_release(U, current, energised, period, rules)
    else:
        yield from _at_rest(float(np.median(U[start])), float(np.median(current[start])), rules)


def _holding(voltage: float, current: float, rules: RecordingRules) -> Iterator[str]:
    """The energised start: a voltage of operation, and a current of U/R."""
    low, high = rules.operating_voltages
    if not low <= voltage <= high:
        yield f"the energised coil has {voltage:.4g} V, and {low:g} to {high:g} V are usual"
    least, greatest = rules.coil_resistances
    resistance = voltage / current if current else np.inf
    if not least <= resistance <= greatest:
        yield (
            f"{voltage:.4g} V and a holding current of {current:.4g} A make {resistance:.4g} ohm, and "
            f"coils have {least:g} to {greatest:g} ohm"
        )


def _after_release(
    U: NDArray, current: NDArray, energised: NDArray, period: float, rules: RecordingRules
) -> Iterator[str]:
    """A coil that was switched off has lost its voltage and, soon, its current."""
    if not np.any(~energised):
        return
    voltage, most = float(np.median(U[~energised])), rules.most_rest_voltage * float(np.max(U))
    if abs(voltage) > most:
        yield f"the voltage is {voltage:.4g} V while the coil is off"
    settled = settled_samples(energised, period, rules)
    if np.any(settled):
        yield from _rest_current(float(np.median(current[settled])), rules)


def settled_samples(energised: NDArray, period: float, rules: RecordingRules = RULES) -> NDArray:
    """Whether the coil has been off for its decay time: boolean like `energised`, (samples,).

    period: between samples [s].
    """
    index = np.arange(len(energised))
    last_on = np.maximum.accumulate(np.where(energised, index, -1))
    return (index - last_on) * period > rules.decay_time


def _at_rest(voltage: float, current: float, rules: RecordingRules) -> Iterator[str]:
    """A coil that is off from the beginning."""
    sensor = rules.sensors["U"]
    if abs(voltage) > sensor.accuracy * sensor.high:
        yield f"the voltage is {voltage:.4g} V, neither off nor on"
    yield from _rest_current(current, rules)


def _rest_current(current: float, rules: RecordingRules) -> Iterator[str]:
    if abs(current) > rules.most_rest_current:
        yield f"a current of {current:.4g} A flows while the coil is off"
