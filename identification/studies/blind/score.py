"""One opened answer against its label: what was right. Pure functions of both files' contents."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from epv_env.plant.effects.registry import effect as effect_record
from epv_env.plant.parameters import Parameters
from identification.studies.blind.noise_free_gap import NoiseFree, distance, held_out_gap
from identification.studies.blind.truth import LEFT_OUT, NONE, PARAMETER
from identification.valve_gap.causes import PARAMETER_COMPONENTS

VERDICTS = ("no_gap", "known", "ambiguous", "unknown", "failed")
"""Of gap.json, and what a diagnosis that gave none counts as."""

ABSORBED = "absorbed"
"""Kind of a trial whose effects recalibration follows, so that `no_gap` is the right verdict."""

LEAST_GAP = 0.02
"""Gap above the floor below which shares of it say nothing."""


@dataclass(frozen=True, kw_only=True)
class Magnitude:
    """One size as diagnosed, of a cause that is right."""

    symbol: str
    error: float
    """|diagnosed - true| over |true - what the nominal model has| [-]."""
    inside: bool
    """Whether the diagnosed interval holds the true size."""


@dataclass(frozen=True, kw_only=True)
class Shrink:
    """The share of the gap that the diagnosed cause closes."""

    true: float
    """By replay of the reported parameters on the noise-free held-out recordings."""
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """Whether the diagnosed interval holds it."""
        return self.low <= self.true <= self.high


@dataclass(frozen=True, kw_only=True)
class Scored:
    """One trial."""

    number: int
    kind: str
    """As drawn, or ABSORBED."""
    effects: tuple[str, ...]
    verdict: str
    first: tuple[str, ...]
    """The first cause; () where none is named."""
    first_right: bool
    in_set: bool
    set_size: int
    probability: float
    """On causes that are right."""
    component: str
    """The likeliest; '' where none is named."""
    component_right: bool
    rival: float | None
    """Distance of the nearest rival that is in the set with the truth (`rival_distance`)."""
    explainable: float
    """Noise-free gap that no unit of the nominal design explains."""
    magnitudes: tuple[Magnitude, ...]
    shrink: Shrink | None
    seconds: float | None


def scored(
    label: Mapping[str, Any],
    answer: Mapping[str, Any] | None,
    shrink: Shrink | None,
    rival: float | None = None,
) -> Scored:
    """A label against its answer (docs/gap.md; None: there is none)."""
    said = answer or {"verdict": "failed"}
    causes = said.get("causes", [])
    named = said["verdict"] in ("known", "ambiguous")
    right = [cause for cause in causes if is_right(label, cause["effects"])]
    components = said.get("where", {}).get("component", {})
    component = max(components, key=components.get) if any(components.values()) else ""
    kind = label["kind"]
    chosen = said.get("ambiguity_set", []) if named else []
    return Scored(
        number=label["trial"],
        kind=kind if kind == NONE or label["visible"] else ABSORBED,
        effects=tuple(label["effects"]),
        verdict=said["verdict"],
        first=tuple(causes[0]["effects"]) if named and causes else (),
        first_right=named and bool(causes) and is_right(label, causes[0]["effects"]),
        in_set=any(is_right(label, effects) for effects in chosen),
        set_size=len(chosen),
        probability=sum(cause["probability"] for cause in right),
        component=component,
        component_right=component in {component_of(effect) for effect in label["visible"]},
        rival=rival,
        explainable=label["gap"]["explainable"],
        magnitudes=tuple(_magnitudes(label, right[0])) if right and named else (),
        shrink=shrink,
        seconds=said.get("seconds"),
    )


def is_right(label: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """Whether a cause names all that can be seen of the truth, and nothing that is not true.

    An effect of a pair that recalibration follows may be named or not. Order does not matter.
    """
    visible, true = set(label["visible"]), set(label["effects"])
    return bool(visible) and visible <= set(effects) <= true


def component_of(effect: str) -> str:
    """Component in which a cause lies."""
    if effect.startswith(PARAMETER):
        return PARAMETER_COMPONENTS[effect.removeprefix(PARAMETER)]
    return effect_record(effect).component


def true_shrink(answer: Mapping[str, Any] | None, truth: Sequence[NoiseFree]) -> Shrink | None:
    """What the first cause closes of the gap that recalibration leaves, on noise-free held-out data.

    Both gaps are those of the reported parameters, replayed. None where no cause is named with an
    interval, or where recalibration leaves nothing to close.
    """
    if answer is None or answer["verdict"] not in ("known", "ambiguous") or not answer["causes"]:
        return None
    said = answer["causes"][0].get("shrink") or {}
    parameters = answer.get("parameters", {})
    if said.get("low") is None or said.get("high") is None or not parameters.get("with_cause"):
        return None
    before = held_out_gap(truth, _known(parameters["recalibrated"]))
    if before - 1.0 < LEAST_GAP:
        return None
    sizes = {symbol: value[0] for symbol, value in _sizes(answer["causes"][0]).items()}
    after = held_out_gap(truth, _known({**sizes, **parameters["with_cause"]}))
    return Shrink(true=(before - after) / (before - 1.0), low=said["low"], high=said["high"])


def rival_distance(
    label: Mapping[str, Any], answer: Mapping[str, Any] | None, truth: Sequence[NoiseFree]
) -> float | None:
    """How near to the noise-free truth a cause comes that stands in the ambiguity set beside it.

    Of the nearest, in noise deviations (noise_free.distance). A cause that holds all of the truth is no
    rival: it comes as near as the truth by leaving the rest at nothing. None where the truth has none.
    """
    if answer is None or answer["verdict"] != "ambiguous":
        return None
    members = [cause for cause in answer["causes"] if cause["effects"] in answer["ambiguity_set"]]
    if not any(is_right(label, cause["effects"]) for cause in members):
        return None
    rivals = [cause for cause in members if not set(label["visible"]) <= set(cause["effects"])]
    starts = [{symbol: value[0] for symbol, value in _sizes(cause).items()} for cause in rivals]
    return min((distance(truth, start) for start in starts if all(start.values())), default=None)


def row_of(kind: str) -> str:
    """What a kind of trial is called."""
    return {
        NONE: "no effect", ABSORBED: "absorbed by the four", "one": "one cause", "pair": "two effects",
        LEFT_OUT: "effect struck from the catalogue",
    }[kind]  # fmt: skip


def _magnitudes(label: Mapping[str, Any], cause: Mapping[str, Any]) -> list[Magnitude]:
    found = []
    nominal = Parameters.calibrated()
    for symbol, (value, low, high) in _sizes(cause).items():
        if symbol in label["sizes"]:
            true = label["sizes"][symbol]
            error = abs(value - true) / abs(true - nominal[symbol])
            found.append(Magnitude(symbol=symbol, error=error, inside=low <= true <= high))
    return found


def _sizes(cause: Mapping[str, Any]) -> dict[str, Any]:
    """Magnitudes of a cause by symbol; gap.json names them symbol_unit."""
    symbols = sorted(Parameters.calibrated(), key=len)
    found = {}
    for name, interval in cause.get("magnitude", {}).items():
        fitting = [symbol for symbol in symbols if f"{name}_".startswith(f"{symbol}_")]
        if fitting:
            found[fitting[-1]] = interval
    return found


def _known(values: Mapping[str, Any]) -> dict[str, float]:
    """Values of the plant's own parameters; a report may hold more."""
    return {symbol: float(values[symbol]) for symbol in Parameters.calibrated() if symbol in values}
