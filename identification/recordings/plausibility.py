"""Units, references, signs and times of a recording: physics says what the readings contradict.

With the coil on and at rest, the open inlet makes p3 equal to p1, and the current is U/R. With the coil
off, p3 vents through choked flow towards absolute zero at a known rate and ends at ambient pressure; p1
and p2 do not. A recording that contradicts this is refused. Why is not guessed, nothing is converted.
What a fault of valve, driver or sensor can cause, such as a current that does not end, is left to the
diagnosis.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.noise import quantisation_step, white_noise
from identification.recordings.columns import CHANNEL_OF, Place
from identification.recordings.recording import RULES, CampaignError, RecordingRules

CLIPPED_TIME, CLIPPED_SAMPLES = 0.02, 20
"""A live reading is clipped if it stays at one end for this long [s] and this many samples."""
LIVE_NOISE, LIVE_CODES = 0.5, 8
"""Noise of a live channel over the step of its readings, and least number of its other readings: a
steady pressure in coarse steps has few, and may stay at the least of them."""

SWITCHING_NOISE = 10.0
"""Range of a voltage that switches, over the changes of nine samples in ten; noise has 3."""
LEAST_VOLTAGE = 1.0 / 6.0
"""Greatest voltage of a coil that is on at all, over the least operating voltage; noise has 0.012 V."""
MOST_REST_VOLTAGE = 0.1
"""Voltage of a coil that is off, over its voltage when it is on; flyback is shorter than half."""
MOST_REST_CURRENT = 0.5
"""Current of a coil that is off, over that of one that is on: an eddy current, a leaking driver or an
offset of the sensor leaves less, readings of another signal more."""
DECAY_TIME = 0.03
"""Time after which no current flows in a coil that was switched off [s]; six time constants."""
SENSOR_FAULT = 0.65
"""Difference of p1 and p3 through an open inlet that a faulty sensor may cause [bar]: the diagnosis is
to find it. A wrong reference (gauge for absolute) makes 1 bar, a wrong unit more."""

CHOKED_RATIO = 2.2
"""Pressure over ambient above which outflow is choked (from 1.9 on), with room for noise."""
LEAST_DISCHARGE, LEAST_FALL = 20, 0.25
"""Samples (40 ms at 500 Hz) and relative fall of a discharge that shows where the pressure falls to."""
GAUGE_LIKENESS = 0.3
"""Part of the ambient pressure within which the end of a discharge meets that of a gauge reading."""
NEARLY_VENTED = 1.5
"""Pressure over ambient below which a circuit counts as vented: an open supply must fill it."""


def check_units(
    place: Place,
    columns: Mapping[str, NDArray],
    period: float,
    ambient_bar: float,
    rules: RecordingRules = RULES,
) -> None:
    """Raise CampaignError if physics contradicts the columns, with the first contradiction.

    Args:
        place: what messages call the recording and its samples.
        columns: by the file's column names, each (samples,) in the unit of the name.
        period: between samples [s].
        ambient_bar: p_env [bar absolute].
    """
    names = {"U": "U_V", "I": "I_A"}
    _refuse(place, names, _electrical(columns["U_V"], columns["I_A"], period, rules))
    on = energised_samples(columns["U_V"], rules)
    for supply in (column for column, name in CHANNEL_OF.items() if name == "p1" and column in columns):
        names = {"p1": supply, "p2": "p2_bar", "p3": "p3_bar"}
        pressures = {name: columns[column] for name, column in names.items()}
        _refuse(place, names, _pressures(pressures, on, ambient_bar, rules))
    _check_venting(place, columns["p3_bar"], on, period, ambient_bar, rules)


def _refuse(place: Place, names: Mapping[str, str], contradictions: Iterator[str]) -> None:
    """Raise CampaignError with the first contradiction; names: the columns of its channels."""
    for found in contradictions:
        blamed = [column for name, column in names.items() if re.search(rf"\b{name}\b", found)]
        columns = ", ".join(blamed or names.values())
        raise CampaignError(f"{place}: {found}: check unit, reference, sign and sensor of {columns}")


def clipped(values: NDArray, period: float) -> tuple[int, int] | None:
    """First and last sample at which a live channel (samples,) stays at its own end; None: at neither.

    Noise moves its other readings. A channel in coarse steps, or at rest at 0, may stay. period: [s].
    """
    for end in (np.max(values), np.min(values)):
        first, count = longest_run(values == end)
        pieces = np.split(values, np.flatnonzero(np.diff(values == end)) + 1)
        others = [piece for piece in pieces if piece[0] != end]
        if (
            end != 0.0
            and count >= max(CLIPPED_SAMPLES, CLIPPED_TIME / period - 1e-6)
            and len(np.unique(values)) > LIVE_CODES
            and white_noise(others) > LIVE_NOISE * quantisation_step(others)
        ):
            return first, first + count - 1
    return None


def longest_run(mask: NDArray) -> tuple[int, int]:
    """First index and length of the longest run of true in a boolean array (samples,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    lengths = edges[1::2] - edges[::2]
    if not lengths.size:
        return 0, 0
    longest = int(np.argmax(lengths))
    return int(edges[2 * longest]), int(lengths[longest])


def switches(U: NDArray) -> bool:
    """Whether a coil, at voltages (samples,) in any unit, is on and off: around half the greatest.

    Noise does not switch: its samples differ from each other by nearly as much as from the mean.
    """
    size, noise = np.abs(U), np.quantile(np.abs(np.diff(U)), 0.9)
    return bool(np.min(size) < 0.5 * np.max(size) and np.ptp(U) > SWITCHING_NOISE * noise)


def energised_samples(U: NDArray, rules: RecordingRules = RULES) -> NDArray:
    """Whether the coil is on, boolean like `U` (samples,) [V]: above half the greatest voltage."""
    greatest = float(np.max(U))
    return (0.5 * greatest < U) & (greatest > LEAST_VOLTAGE * rules.operating_voltages[0])


def _starting_state(energised: NDArray) -> slice:
    """Samples before the coil, boolean (samples,), first switches."""
    changes = np.flatnonzero(np.diff(energised))
    return slice(0, int(changes[0]) + 1 if changes.size else len(energised))


def _electrical(U: NDArray, current: NDArray, period: float, rules: RecordingRules) -> Iterator[str]:
    """What voltage [V] and current [A], (samples,), cannot be: U/R while the coil holds, then none."""
    on = energised_samples(U, rules)
    start = _starting_state(on)
    low, high = rules.operating_voltages
    level = float(np.median(U[start]))
    if switches(U) and not np.any(on):
        yield f"U switches at {U[np.argmax(np.abs(U))]:.4g} V, and {low:g} to {high:g} V are usual"
    if switches(current) and not np.any(on):
        yield f"I switches at {current[np.argmax(np.abs(current))]:.4g} A, and the voltage never does"
    if not on[0] and abs(level) > rules.sensors["U"].margin:
        yield f"the voltage is {level:.4g} V, neither off nor on"
    if on[0]:
        if not low <= level <= high:
            yield f"the energised coil has {level:.4g} V, and {low:g} to {high:g} V are usual"
        off = float(np.median(U[~on])) if np.any(~on) else 0.0
        if abs(off) > MOST_REST_VOLTAGE * float(np.max(U)):
            yield f"the voltage is {off:.4g} V while the coil is off"
        least, greatest = rules.coil_resistances
        held = float(np.median(current[start]))
        resistance = level / held if held else np.inf
        if not least <= resistance <= greatest:
            yield (
                f"{level:.4g} V and a holding current of {held:.4g} A make {resistance:.4g} ohm, and "
                f"coils have {least:g} to {greatest:g} ohm"
            )
    samples = np.arange(len(on))
    off_since = samples - np.maximum.accumulate(np.where(on, samples, -len(on)))
    settled = current[off_since * period > DECAY_TIME]
    if np.any(on) and len(settled):
        rest, held = float(np.median(settled)), float(np.median(current[on]))
        if abs(rest) > MOST_REST_CURRENT * abs(held):
            yield f"a current of {rest:.4g} A flows while the coil is off, and {held:.4g} A while on"


def _pressures(
    signals: Mapping[str, NDArray], on: NDArray, ambient: float, rules: RecordingRules
) -> Iterator[str]:
    """What p1, p2 and p3, each (samples,) [bar], cannot be.

    on: whether the coil is, boolean (samples,). ambient: p_env [bar absolute].
    """
    margin = rules.pressure_margin
    yield from gauge_contradiction(signals["p3"], on, ambient)
    least, most = {}, {}
    for name, values in signals.items():  # a hundredth of the samples may have a fault of another kind
        least[name], most[name] = (float(q) for q in np.quantile(values, (0.01, 0.99)))
        highest = rules.sensors[name].high
        if least[name] < ambient - margin:
            yield f"{name} falls to {least[name]:.4g} bar, below the ambient {ambient:g} bar"
        if most[name] > highest + margin:
            yield f"{name} rises to {most[name]:.4g} bar, beyond the sensor's {highest:g} bar"
    start = _starting_state(on)
    p1, p2, p3 = (float(np.mean(signals[name][start])) for name in ("p1", "p2", "p3"))
    if not on[0]:
        if abs(p3 - ambient) > margin:
            yield f"at rest, p3 is {p3:.4g} bar, and the exhaust is open to the ambient {ambient:g} bar"
        if p1 > p2 + 2 * margin:
            yield f"at rest, p1 is {p1:.4g} and p2 {p2:.4g} bar, although the open valve joins them"
        return
    if abs(p1 - p3) > max(2 * margin, SENSOR_FAULT):
        yield f"with the coil on, p1 is {p1:.4g} and p3 {p3:.4g} bar, although the open inlet joins them"
    if p2 > p1 + 2 * margin:
        yield f"the circuit's p2 of {p2:.4g} bar lies above its supply p1 of {p1:.4g} bar"
    if np.all(on):
        return
    if p1 < CHOKED_RATIO * ambient:
        yield f"a supply p1 of {p1:.4g} bar absolute is next to empty"
    fall = max(1.0 - least["p3"] / p3, 0.0)
    for name, level in (("p1", p1), ("p2", p2)):
        if 1.0 - least[name] / level > fall + 0.05:
            yield f"with the coil off, {name} falls to {least[name]:.4g} bar and p3 to {least['p3']:.4g}"
    rise = most["p2"] - p2
    if fall > 0.35 and p2 < NEARLY_VENTED * ambient and rise < 2 * margin:
        yield f"p2 rises by only {rise:.2g} bar from {p2:.4g}, although the valve opens"


def gauge_contradiction(
    p3: NDArray, on: NDArray, ambient: float, least: int = LEAST_DISCHARGE
) -> Iterator[str]:
    """What shows that p3 is gauge pressure, if anything does.

    p3: (samples,) [bar]. on: whether the coil is, boolean (samples,). ambient: p_env [bar absolute].
    least: samples of a discharge that counts.
    """
    discharges = _discharges(p3, on, ambient, least)
    if discharges:
        # Whole discharges and their late parts must agree: a slow sensor bends the beginning.
        late = [slice((2 * part.start + part.stop) // 3, part.stop) for part in discharges]
        ends = [_median_end(p3, parts) for parts in (discharges, late)]
        if all(abs(end + ambient) < GAUGE_LIKENESS * ambient for end in ends):
            yield f"p3 vents towards {ends[0]:.2f} bar as gauge pressure does, not towards 0 bar"


def _discharges(p3: NDArray, on: NDArray, ambient: float, least: int = LEAST_DISCHARGE) -> list[slice]:
    """Samples, from each switching-off, in which p3 (samples,) [bar] falls far through choked flow."""
    found = []
    for first, last in pairwise([0, *(np.flatnonzero(np.diff(on)) + 1), len(p3)]):
        falling = (p3[first:last] < 0.9 * p3[first]) & (p3[first:last] > CHOKED_RATIO * ambient)
        if on[first] or not np.any(falling):
            continue
        inside = first + np.flatnonzero(falling)
        part = slice(int(inside[0]), int(inside[-1]) + 1)
        long = part.stop - part.start >= least
        if long and p3[part.stop - 1] < (1 - LEAST_FALL) * p3[part.start]:
            found.append(part)
    return found


def _median_end(p3: NDArray, parts: Sequence[slice]) -> float:
    """Pressure [bar] towards which p3 falls, by least squares on the integral of its exponential.

    p(t) = e + (p(0) - e) exp(-k t) gives p(t) - p(0) = k e t - k (integral of p), linear in k e and k,
    and the integral averages noise. Time counts in samples: wrong times hide no wrong reference.
    """
    ends = []
    for pressure in (p3[part] for part in parts):
        integral = np.concatenate([[0.0], np.cumsum(0.5 * (pressure[1:] + pressure[:-1]))])
        basis = np.stack([np.ones(len(pressure)), np.arange(len(pressure)), -integral], axis=1)
        _, product, rate = np.linalg.lstsq(basis, pressure, rcond=None)[0]
        ends.append(product / rate)
    return float(np.median(ends))


def _check_venting(
    place: Place, p3: NDArray, on: NDArray, period: float, ambient: float, rules: RecordingRules
) -> None:
    """The control chamber vents at a rate that its exhaust and volume allow, or the times are wrong."""
    discharges = _discharges(p3, on, ambient)
    if not on[0] or not discharges:
        return
    falling = [np.log(np.maximum(p3[d], 1e-3)) for d in discharges]  # a wild reading may be negative
    slopes = [np.polyfit(np.arange(len(own)), own, 1)[0] for own in falling]
    rate, (least, greatest) = float(np.median(slopes)) / -period, rules.venting_rates
    if least <= rate <= greatest:
        return
    raise CampaignError(
        f"{place}: p3 vents at {rate:.3g} 1/s, and this valve at {least:g} "
        f"to {greatest:g}: check unit and rate of time_s, or give another valve's --plant"
    )
