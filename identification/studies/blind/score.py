"""One diagnosis scored against its label: what is correct. Functions of both files' contents."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from epv_env.plant.effects.registry import effect
from epv_env.plant.parameters import Parameters
from identification.studies.blind.kinds import ABSORBED, NOMINAL, PARAMETER
from identification.studies.blind.noise_free_gap import (
    NoiseFreeRecording,
    held_out_gap,
    hypothesis_distance,
)
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.valve_gap.causes import PARAMETER_COMPONENTS

VERDICTS = ("no_gap", "known", "ambiguous", "unknown", "failed")
"""Verdicts of gap.json, and `failed` for a diagnosis that gave none."""

NAMING_VERDICTS = ("known", "ambiguous")
"""Verdicts that name a cause."""


@dataclass(frozen=True, kw_only=True)
class SizeEstimate:
    """One diagnosed size of a correct cause."""

    symbol: str
    """Of the parameter that holds the size."""
    error: float
    """|diagnosed - true| over |true - value of the nominal model| [-]."""
    inside: bool
    """Whether the diagnosed interval holds the true size."""


@dataclass(frozen=True, kw_only=True)
class GapReduction:
    """The share of the gap that the diagnosed cause removes."""

    true: float
    """By replay of the reported parameters on the noise-free held-out recordings [-]."""
    low: float
    """Lower end of the diagnosed interval [-]."""
    high: float
    """Upper end of the diagnosed interval [-]."""

    @property
    def inside(self) -> bool:
        """Whether the diagnosed interval holds the true share."""
        return self.low <= self.true <= self.high


@dataclass(frozen=True, kw_only=True)
class TrialScore:
    """One trial's truth, diagnosis and score."""

    number: int
    """Of the trial."""
    kind: str
    """As drawn, or ABSORBED."""
    causes: tuple[str, ...]
    """The true causes."""
    verdict: str
    """One of VERDICTS."""
    first_cause: tuple[str, ...]
    """Effects of the most probable cause; () where none is named."""
    first_cause_correct: bool
    """Whether a cause is named and the most probable one is correct."""
    truth_in_set: bool
    """Whether the ambiguity set holds a correct cause."""
    set_size: int
    """Causes in the ambiguity set [-]; 0 where no cause is named."""
    probability: float
    """Sum over the correct causes [-]."""
    component: str
    """The most probable component; '' where none is named."""
    component_correct: bool
    """Whether a visible cause lies in this component."""
    rival_distance: float | None
    """Of `rival_distance` [noise deviations]."""
    explainable_gap: float
    """Noise-free gap that no unit of the nominal design explains [-]."""
    size_estimates: tuple[SizeEstimate, ...]
    """Sizes of the correct cause, where a cause is named."""
    gap_reduction: GapReduction | None
    """Of `true_gap_reduction`."""
    seconds: float | None
    """Time of the diagnosis [s]; None where there is none."""


def score_trial(
    label: Mapping[str, Any],
    diagnosis: Mapping[str, Any] | None,
    gap_reduction: GapReduction | None,
    distance: float | None = None,
) -> TrialScore:
    """The score of one trial.

    Args:
        label: content of sealed.json.
        diagnosis: content of gap.json (docs/reference/gap-json.md); None: there is no diagnosis.
        gap_reduction: of `true_gap_reduction`.
        distance: of `rival_distance` [noise deviations].
    """
    said = diagnosis or {"verdict": "failed"}
    causes = said.get("causes", [])
    named = said["verdict"] in NAMING_VERDICTS
    correct = [cause for cause in causes if is_correct(label, cause["effects"])]
    component = _most_probable_component(said)
    kind = label["kind"]
    ambiguity_set = said.get("ambiguity_set", []) if named else []
    return TrialScore(
        number=label["trial"],
        kind=kind if kind == NOMINAL or label["visible"] else ABSORBED,
        causes=tuple(label["effects"]),
        verdict=said["verdict"],
        first_cause=tuple(causes[0]["effects"]) if named and causes else (),
        first_cause_correct=named and bool(causes) and is_correct(label, causes[0]["effects"]),
        truth_in_set=any(is_correct(label, effects) for effects in ambiguity_set),
        set_size=len(ambiguity_set),
        probability=sum(cause["probability"] for cause in correct),
        component=component,
        component_correct=component in {component_of(cause) for cause in label["visible"]},
        rival_distance=distance,
        explainable_gap=label["gap"]["explainable"],
        size_estimates=tuple(_size_estimates(label, correct[0])) if correct and named else (),
        gap_reduction=gap_reduction,
        seconds=said.get("seconds"),
    )


def is_correct(label: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """Whether a cause names all visible causes of the truth, and nothing that is untrue.

    A cause may name or omit an effect of a pair that recalibration absorbs. The order does not matter.
    """
    visible, true = set(label["visible"]), set(label["effects"])
    return bool(visible) and visible <= set(effects) <= true


def component_of(cause: str) -> str:
    """Component in which a cause lies."""
    if cause.startswith(PARAMETER):
        return PARAMETER_COMPONENTS[cause.removeprefix(PARAMETER)]
    return effect(cause).component


def true_gap_reduction(
    diagnosis: Mapping[str, Any] | None,
    truth: Sequence[NoiseFreeRecording],
    settings: BlindSettings = DEFAULTS,
) -> GapReduction | None:
    """Share of the recalibrated gap that the first cause removes, on noise-free held-out recordings.

    Both gaps are those of the reported parameters, replayed. None where no cause is named with an
    interval, or where recalibration leaves too small a gap.
    """
    if diagnosis is None or diagnosis["verdict"] not in NAMING_VERDICTS or not diagnosis["causes"]:
        return None
    cause = diagnosis["causes"][0]
    said, parameters = cause.get("shrink") or {}, diagnosis.get("parameters", {})
    if said.get("low") is None or said.get("high") is None or not parameters.get("with_cause"):
        return None
    before = held_out_gap(truth, _plant_values(parameters["recalibrated"]), settings)
    if before - 1.0 < settings.smallest_gap:
        return None
    with_cause = {**_estimated_sizes(cause), **parameters["with_cause"]}
    after = held_out_gap(truth, _plant_values(with_cause), settings)
    return GapReduction(true=(before - after) / (before - 1.0), low=said["low"], high=said["high"])


def rival_distance(
    label: Mapping[str, Any],
    diagnosis: Mapping[str, Any] | None,
    truth: Sequence[NoiseFreeRecording],
    settings: BlindSettings = DEFAULTS,
) -> float | None:
    """Distance of the nearest wrong cause in the truth's ambiguity set [noise deviations].

    A cause that holds all of the truth is no rival: with its other effects at zero it equals the truth.
    None where the set does not hold the truth, or has no rival.
    """
    if diagnosis is None or diagnosis["verdict"] != "ambiguous":
        return None
    ambiguity_set = diagnosis["ambiguity_set"]
    members = [cause for cause in diagnosis["causes"] if cause["effects"] in ambiguity_set]
    if not any(is_correct(label, cause["effects"]) for cause in members):
        return None
    rivals = [cause for cause in members if not set(label["visible"]) <= set(cause["effects"])]
    starts = [_estimated_sizes(cause) for cause in rivals]
    distances = (hypothesis_distance(truth, start, settings) for start in starts if all(start.values()))
    return min(distances, default=None)


def _most_probable_component(diagnosis: Mapping[str, Any]) -> str:
    components = diagnosis.get("where", {}).get("component", {})
    return max(components, key=components.get) if any(components.values()) else ""


def _size_estimates(label: Mapping[str, Any], cause: Mapping[str, Any]) -> list[SizeEstimate]:
    estimates = []
    nominal = Parameters.calibrated()
    for symbol, (value, low, high) in _size_intervals(cause).items():
        if symbol in label["sizes"]:
            true = label["sizes"][symbol]
            error = abs(value - true) / abs(true - nominal[symbol])
            inside = low <= true <= high
            estimates.append(SizeEstimate(symbol=symbol, error=error, inside=inside))
    return estimates


def _estimated_sizes(cause: Mapping[str, Any]) -> dict[str, float]:
    """Estimated sizes of a cause by symbol [SI]."""
    return {symbol: interval[0] for symbol, interval in _size_intervals(cause).items()}


def _size_intervals(cause: Mapping[str, Any]) -> dict[str, Any]:
    """Estimate, low and high end of each size of a cause by symbol; gap.json has symbol_unit."""
    symbols = sorted(Parameters.calibrated(), key=len)
    intervals = {}
    for name, interval in cause.get("magnitude", {}).items():
        matching = [symbol for symbol in symbols if f"{name}_".startswith(f"{symbol}_")]
        if matching:
            intervals[matching[-1]] = interval
    return intervals


def _plant_values(values: Mapping[str, Any]) -> dict[str, float]:
    """Values of the plant's own parameters [SI]; a diagnosis may report more."""
    return {symbol: float(values[symbol]) for symbol in Parameters.calibrated() if symbol in values}
