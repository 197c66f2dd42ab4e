"""What the valve's physics contradicts in its pressures (bar absolute).

Energised and at rest, the open inlet makes p3 equal to p1, and the circuit lies below both. With the
coil off, p3 falls towards absolute zero through choked flow and ends at ambient pressure; p1 and p2 do
not. Nothing falls below ambient.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from identification.recordings.discharge import choked_discharges, discharge_ends
from identification.recordings.electrical_evidence import starting_state
from identification.recordings.rules import RULES, RecordingRules


def pressure_contradictions(
    signals: Mapping[str, NDArray],
    energised: NDArray,
    ambient: float,
    rules: RecordingRules = RULES,
) -> Iterator[str]:
    """Sentences on what p1, p2 and p3 cannot be; none if physics allows them.

    signals: p1, p2 and p3 [bar], each (samples,). energised: whether the coil is on, boolean
    (samples,). ambient: p_env [bar absolute].
    """
    yield from _ranges(signals, ambient, rules)
    start = starting_state(energised)
    levels = {name: float(np.mean(values[start])) for name, values in signals.items()}
    if energised[0]:
        yield from _energised_start(levels, rules)
    else:
        yield from _at_rest(levels, ambient, rules)
    if energised[0] and not np.all(energised):
        yield from _supply(levels["p1"], ambient, rules)
        yield from _falls(signals, levels)
        yield from _filling(signals, levels, ambient, rules)
        yield from _venting_end(signals["p3"], energised, ambient, rules)


def _ranges(signals: Mapping[str, NDArray], ambient: float, rules: RecordingRules) -> Iterator[str]:
    """A hundredth of the samples may be elsewhere: a few are a fault of another kind."""
    for name, values in signals.items():
        low, high = np.quantile(values, (0.01, 0.99))
        margin, highest = rules.pressure_margin, rules.sensors[name].high
        if low < ambient - margin:
            yield f"{name} falls to {low:.4g} bar, below the ambient {ambient:g} bar"
        if high > highest + margin:
            yield f"{name} rises to {high:.4g} bar, beyond the sensor's {highest:g} bar"


def _energised_start(levels: Mapping[str, float], rules: RecordingRules) -> Iterator[str]:
    p1, p2, p3 = (levels[name] for name in ("p1", "p2", "p3"))
    if abs(p1 - p3) > 2 * rules.pressure_margin:
        yield f"with the coil on, p1 is {p1:.4g} and p3 {p3:.4g} bar, although the open inlet joins them"
    if p2 > p1 + 2 * rules.pressure_margin:
        yield f"the circuit's p2 of {p2:.4g} bar lies above its supply p1 of {p1:.4g} bar"


def _supply(p1: float, ambient: float, rules: RecordingRules) -> Iterator[str]:
    if p1 < rules.choked_ratio * ambient:
        yield f"a supply p1 of {p1:.4g} bar absolute is next to empty"


def _falls(signals: Mapping[str, NDArray], levels: Mapping[str, float]) -> Iterator[str]:
    """Switched off, p3 vents, and neither the supply nor the circuit does."""
    least = {name: float(np.quantile(values, 0.01)) for name, values in signals.items()}
    fall = {name: 1.0 - least[name] / levels[name] for name in levels}
    for name in ("p1", "p2"):
        if fall[name] > max(fall["p3"], 0.0) + 0.05:
            yield f"with the coil off, {name} falls to {least[name]:.4g} bar and p3 to {least['p3']:.4g}"


def _filling(
    signals: Mapping[str, NDArray], levels: Mapping[str, float], ambient: float, rules: RecordingRules
) -> Iterator[str]:
    """An open valve fills a circuit that is next to empty."""
    rise = float(np.quantile(signals["p2"], 0.99)) - levels["p2"]
    opened = np.quantile(signals["p3"], 0.01) < 0.65 * levels["p3"]
    if opened and levels["p2"] < rules.nearly_vented * ambient and rise < 2 * rules.pressure_margin:
        yield f"p2 rises by only {rise:.2g} bar from {levels['p2']:.4g}, although the valve opens"


def _venting_end(
    p3: NDArray, energised: NDArray, ambient: float, rules: RecordingRules
) -> Iterator[str]:
    discharges = choked_discharges(p3, energised, ambient, rules)
    if not discharges:
        return
    ends = np.array(discharge_ends(p3, discharges))
    if np.all(np.abs(ends + ambient) < rules.gauge_likeness * ambient):
        yield f"p3 vents towards {ends[0]:.2f} bar, and choked flow leads towards 0 bar absolute"


def _at_rest(levels: Mapping[str, float], ambient: float, rules: RecordingRules) -> Iterator[str]:
    """Coil off for long: p3 is ambient, and the open valve lets p2 fill up to p1."""
    p1, p2, p3 = (levels[name] for name in ("p1", "p2", "p3"))
    if abs(p3 - ambient) > rules.pressure_margin:
        yield f"at rest, p3 is {p3:.4g} bar, and the exhaust is open to the ambient {ambient:g} bar"
    if p1 > p2 + 2 * rules.pressure_margin:
        yield f"at rest, p1 is {p1:.4g} and p2 {p2:.4g} bar, although the open valve joins them"
    for name, level, other in (("p1", p1, p2), ("p2", p2, p1)):
        doubled = abs(level - 2 * ambient) < rules.gauge_likeness * ambient
        if doubled and max(abs(other - ambient), abs(p3 - ambient)) < rules.pressure_margin:
            yield f"at rest, {name} is {level:.4g} bar where the others are at ambient {ambient:g} bar"


def level_offsets(
    signals: Mapping[str, NDArray], energised: NDArray, ambient: float
) -> dict[str, float]:
    """What each pressure lacks to agree with the others at the start [bar], by channel.

    Arguments as for `pressure_contradictions`.
    """
    start = starting_state(energised)
    levels = {name: float(np.mean(values[start])) for name, values in signals.items()}
    if energised[0]:
        return {"p1": levels["p3"] - levels["p1"], "p3": levels["p1"] - levels["p3"]}
    return {name: ambient - level for name, level in levels.items()}
