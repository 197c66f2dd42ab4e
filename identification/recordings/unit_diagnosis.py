"""Units, references, signs and channels of a recording: physics decides, and names what is wrong.

A recording whose channels contradict physics is compared with every misreading of one or two mistakes.
The one that removes all contradictions with the fewest mistakes is named; among equals, the one whose
supply pressure and noise are the most usual.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from identification.recordings.columns import CHANNEL_OF, line_number
from identification.recordings.discharge import choked_discharges, discharge_ends, venting_rate
from identification.recordings.electrical_evidence import (
    electrical_contradictions,
    energised_samples,
    settled_samples,
    starting_state,
)
from identification.recordings.misreadings import (
    Misreading,
    electrical_misreadings,
    pressure_misreadings,
)
from identification.recordings.pressure_evidence import level_offsets, pressure_contradictions
from identification.recordings.recording import CampaignError, Recording
from identification.recordings.rules import RULES, RecordingRules

Signals = Mapping[str, NDArray]
Contradictions = Callable[[Signals], Iterator[str]]


def check_units(
    file: str,
    columns: Mapping[str, NDArray],
    period: float,
    ambient_bar: float,
    rules: RecordingRules = RULES,
) -> None:
    """Raise CampaignError if physics contradicts the columns; the message names the likeliest mistake.

    Args:
        file: what messages call the recording.
        columns: by the file's column names, each (samples,) in the unit of the name.
        period: between samples [s].
        ambient_bar: p_env [bar absolute].
    """
    _check_electrical(file, columns, period, rules)
    energised = energised_samples(columns["U_V"], rules)
    for supply in (column for column, name in CHANNEL_OF.items() if name == "p1" and column in columns):
        _check_pressures(file, columns, supply, energised, ambient_bar, rules)
    _check_venting(file, columns["p3_bar"], energised, period, ambient_bar, rules)


def check_reference(
    place: str, recordings: Sequence[Recording], ambient: float, rules: RecordingRules = RULES
) -> None:
    """Raise CampaignError if p3 vents towards twice the ambient pressure, and never falls below that.

    An effect may bend a discharge so, too; then another recording shows p3 at ambient pressure.
    place: begins the message. ambient: p_env [Pa absolute].
    """
    if any(np.quantile(r.p3, 0.01) < rules.doubled_ambient * ambient for r in recordings):
        return
    ends = []
    for recording in recordings:
        found = choked_discharges(recording.p3 / BAR, recording.energised, ambient / BAR, rules)
        ends += [discharge_ends(recording.p3 / BAR, found)] if found else []
    if ends and np.all(np.abs(np.median(ends, axis=0) * BAR - ambient) < rules.gauge_likeness * ambient):
        raise CampaignError(
            f"{place}: p3 vents towards {np.median(ends, axis=0)[0]:.2f} bar in most recordings, and "
            "choked flow leads towards 0 bar absolute; the pressures look like absolute pressure to "
            "which the ambient was added: give bar absolute (subtract the environment's pressure once)"
        )


def _check_pressures(
    file: str,
    columns: Mapping[str, NDArray],
    supply: str,
    energised: NDArray,
    ambient: float,
    rules: RecordingRules,
) -> None:
    """The pressures with one of the columns of p1 as supply; ambient [bar]."""
    names = {"p1": supply, "p2": "p2_bar", "p3": "p3_bar"}
    signals = {name: columns[column] for name, column in names.items()}
    _refuse_contradictions(
        file,
        names,
        signals,
        lambda right: pressure_contradictions(right, energised, ambient, rules),
        lambda: pressure_misreadings(ambient, level_offsets(signals, energised, ambient)),
        lambda right: _unusual_pressures(right, energised, ambient, rules),
        rules,
    )


def _check_electrical(
    file: str, columns: Mapping[str, NDArray], period: float, rules: RecordingRules
) -> None:
    signals = {"U": columns["U_V"], "I": columns["I_A"]}
    rest = settled_samples(energised_samples(np.abs(signals["U"]), rules), period, rules)
    _refuse_contradictions(
        file,
        {"U": "U_V", "I": "I_A"},
        signals,
        lambda right: electrical_contradictions(right, period, rules),
        lambda: electrical_misreadings(signals, rest),
        lambda right: _unusual_noise(right, rules),
        rules,
    )


def _refuse_contradictions(
    file: str,
    names: Mapping[str, str],
    signals: Signals,
    contradictions: Contradictions,
    misreadings: Callable[[], Sequence[Misreading]],
    unusual: Callable[[Signals], float],
    rules: RecordingRules,
) -> None:
    found = next(contradictions(signals), None)
    if found is None:
        return
    samples = len(next(iter(signals.values())))
    place = f"{file}, lines {line_number(0)} to {line_number(samples - 1)}"
    likely = _explanations(signals, contradictions, misreadings(), unusual, rules)
    if not likely:
        raise CampaignError(
            f"{place}: {found}, and no single unit, reference, sign or exchange of channels explains "
            f"it: check the channels {', '.join(names.values())}"
        )
    sentences = " (or else ".join(misreading.sentence(names) for misreading in likely)
    raise CampaignError(f"{place}: {found}; {sentences}{')' * (len(likely) - 1)}")


def _explanations(
    signals: Signals,
    contradictions: Contradictions,
    misreadings: Sequence[Misreading],
    unusual: Callable[[Signals], float],
    rules: RecordingRules,
) -> list[Misreading]:
    """The misreadings of least effort that contradict nothing, the most usual first: one or two."""
    found: list[tuple[float, Misreading]] = []
    for misreading in misreadings:
        if found and misreading.effort > found[0][1].effort + 0.25:
            break
        right = misreading.corrected(signals)
        if next(contradictions(right), None) is None:
            found.append((unusual(right) + misreading.effort, misreading))
    found.sort(key=lambda pair: pair[0])
    near = [m for score, m in found if score < found[0][0] + rules.similar_misreadings]
    return near[:2]


def _unusual_pressures(
    signals: Signals, energised: NDArray, ambient: float, rules: RecordingRules
) -> float:
    """Decades by which supply and noise are off the usual, and bars by which p3 is elsewhere."""
    decades = 0.0
    if energised[0]:
        start = starting_state(energised)
        p1, p3 = (float(np.mean(signals[name][start])) for name in ("p1", "p3"))
        decades = abs(float(np.log10(max(p1, 1e-9) / rules.usual_supply))) + abs(p1 - p3)
    discharges = choked_discharges(signals["p3"], energised, ambient, rules)
    end = abs(discharge_ends(signals["p3"], discharges)[0]) if discharges else 0.0
    return decades + min(end, 3.0) + _unusual_noise(signals, rules)


def _unusual_noise(signals: Signals, rules: RecordingRules) -> float:
    """Decades by which the noises of some signals, each (samples,), are off the sensors'."""
    decades = 0.0
    for name, values in signals.items():
        noise = float(np.median(np.abs(np.diff(values)))) / 0.95
        if noise > 0.0:
            decades += abs(float(np.log10(noise / rules.sensors[name].noise)))
    return decades


def _check_venting(
    file: str,
    p3: NDArray,
    energised: NDArray,
    period: float,
    ambient: float,
    rules: RecordingRules,
) -> None:
    """The control chamber vents at a rate that its exhaust and volume allow."""
    discharges = choked_discharges(p3, energised, ambient, rules)
    if not energised[0] or not discharges:
        return
    rate, (least, greatest) = venting_rate(p3, discharges, period), rules.venting_rates
    if least <= rate <= greatest:
        return
    factor = rules.usual_venting / rate
    raise CampaignError(
        f"{file}, line {line_number(discharges[0].start)}: p3 vents at {rate:.3g} 1/s, and this valve "
        f"at {least:g} to {greatest:g}; {_wrong_time(factor)}"
    )


def _wrong_time(factor: float) -> str:
    """What is wrong with times whose rates are too small by a factor, with the remedy."""
    size = f"{factor:.2g} times too long" if factor > 1 else f"{1 / factor:.2g} times too short"
    unit = ""
    if 300 < factor < 3000:
        unit, size = "looks like ms: give s (divide by 1000)", ""
    elif 300 < 1 / factor < 3000:
        unit, size = "looks like ks: give s (multiply by 1000)", ""
    elif 3e5 < factor < 3e6:
        unit, size = "looks like µs: give s (divide by 1000000)", ""
    return (
        f"time_s {unit}"
        if unit
        else f"time_s looks {size}: give the true sampling rate in s, or another valve's --plant"
    )
