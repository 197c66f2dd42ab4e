"""What a diagnosis names, and whether that is right: functions of gap.json and of a label.

Both versions of gap.json are read (docs/reference/gap-json.md); the first has no field `inclusion`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from identification.studies.blind.settings import DEFAULTS, BlindSettings

VERDICTS = ("no_gap", "known", "ambiguous", "partial", "unknown", "failed")
"""Verdicts of gap.json, and `failed` for a diagnosis that gave none."""

NAMING_VERDICTS = ("known", "ambiguous", "partial")
"""Verdicts that name a cause."""


def inclusion(diagnosis: Mapping[str, Any]) -> dict[str, float]:
    """Probability [-] of each effect to be part of the truth, alone or beside others.

    Without the field of that name it is the sum over the listed causes that hold the effect.
    """
    if "inclusion" in diagnosis:
        return dict(diagnosis["inclusion"])
    sums: dict[str, float] = {}
    for cause in diagnosis.get("causes", []):
        for effect in cause["effects"]:
            sums[effect] = sums.get(effect, 0.0) + cause["probability"]
    return sums


def held_effects(diagnosis: Mapping[str, Any], settings: BlindSettings = DEFAULTS) -> tuple[str, ...]:
    """Effects that are surely part of the truth, the surest first."""
    found = inclusion(diagnosis)
    held = [effect for effect, share in found.items() if share >= settings.held_probability]
    return tuple(sorted(held, key=lambda effect: -found[effect]))


def named_cause(diagnosis: Mapping[str, Any], settings: BlindSettings = DEFAULTS) -> tuple[str, ...]:
    """Effects that the verdict names; () where it names none.

    `known` and `ambiguous` name the first listed cause, `partial` all effects that are held.
    """
    causes = diagnosis.get("causes", [])
    if diagnosis["verdict"] == "partial":
        return held_effects(diagnosis, settings)
    named = diagnosis["verdict"] in NAMING_VERDICTS and causes
    return tuple(causes[0]["effects"]) if named else ()


def named_set(diagnosis: Mapping[str, Any], settings: BlindSettings = DEFAULTS) -> list[tuple[str, ...]]:
    """Causes of the ambiguity set; what a `partial` without a set names; [] if nothing is named."""
    if diagnosis["verdict"] not in NAMING_VERDICTS:
        return []
    given = [tuple(effects) for effects in diagnosis.get("ambiguity_set", [])]
    named = named_cause(diagnosis, settings)
    return given or ([named] if diagnosis["verdict"] == "partial" and named else [])


def is_tied(
    label: Mapping[str, Any], diagnosis: Mapping[str, Any], settings: BlindSettings = DEFAULTS
) -> bool:
    """Whether the first cause of `known` or `ambiguous` is as probable as a wrong one after it.

    Its place is then chance. A `partial` names what is held, which has no rival of the same probability.
    """
    causes = diagnosis.get("causes", [])
    if diagnosis["verdict"] not in ("known", "ambiguous") or len(causes) < 2:
        return False
    least = causes[0]["probability"] - settings.tie_margin
    rivals = [cause for cause in causes[1:] if cause["probability"] >= least]
    return any(not is_correct(label, cause["effects"]) for cause in rivals)


def is_correct(label: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """Whether a cause names all visible causes of the truth, and nothing that is untrue.

    A cause may name or omit an effect of a pair that recalibration absorbs. The order does not matter.
    """
    return bool(label["visible"]) and is_true(label, effects)


def is_true(label: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """As `is_correct`; where recalibration absorbs everything, any part of the truth will do."""
    visible, true = set(label["visible"]), set(label["effects"])
    return bool(effects) and visible <= set(effects) <= true
