"""Calibration of the stated probabilities, and the results of a blind check as numbers and as a page.

A statement of probability p should come true in a share p of the cases. The expected calibration error
is the mean over all answers of the distance between the stated probability and the share that came
true, both averaged over bins of equal width (Naeini et al. 2015, Guo et al. 2017). Chance alone lifts
the error of a perfectly calibrated judge above 0, the more the fewer answers a bin has.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identification.blind.score import (
    NAMING_VERDICTS,
    Answer,
    TrialScore,
    is_well_judged,
    means,
    share,
    shares,
)

FIRST, INCLUSION = "first cause", "inclusion of an effect"
"""Statements whose probabilities are compared with what was true.

FIRST: the first listed cause, where the verdict names a cause. INCLUSION: each effect of at least
LEAST_INCLUSION. Without a right cause (no effect, effect struck) every answer is wrong.
"""

BINS = 10
"""Of a reliability diagram [-]: with 300 answers the fullest ones still have narrow intervals."""

BOOTSTRAP_DRAWS = 2000
"""Draws of trials for the interval of a calibration error [-]: its ends are then stable to some percent
of its width."""

CALIBRATION = "calibration error of the first cause"

CRITERIA = {
    "false alarms without an effect": (-math.inf, 0.0),
    "truth in the ambiguity set": (0.96, math.inf),
    "mean size of the ambiguity set": (-math.inf, 1.5),
    "first cause right, ties counted as wrong": (0.90, math.inf),
    "component right": (0.95, math.inf),
    "unknown where the effect is struck": (0.87, math.inf),
    "mean probability on the truth": (0.85, math.inf),
    "seconds per diagnosis": (-math.inf, 60.0),
    CALIBRATION: (-math.inf, 0.05),
}
"""Accepted values of shares, means [-] and the time [s]: least and most. Strong forms are asked for
CALIBRATION alone: there a cause need not be found, but a probability must still mean what it says."""


def answers_by_trial(trials: Sequence[TrialScore]) -> dict[str, list[list[Answer]]]:
    """Answers of each trial by statement (FIRST, INCLUSION); trials without any are left out."""
    found = {
        FIRST: [[t.listed] for t in trials if t.listed and t.verdict in NAMING_VERDICTS],
        INCLUSION: [list(t.inclusions) for t in trials],
    }
    return {name: [answers for answers in groups if answers] for name, groups in found.items()}


def reliability(probability: NDArray, right: NDArray) -> list[dict[str, Any]]:
    """Bins of equal width that hold an answer: mean `probability`, and `right` as `share` gives it.

    probability, right: of each answer, (answers,).
    """
    number = _bin(probability)
    return [
        {"probability": float(np.mean(probability[number == k])), "right": share(right[number == k])}
        for k in np.unique(number)
    ]


def calibration_error(groups: Sequence[Sequence[Answer]]) -> dict[str, float] | None:
    """Expected calibration error with its 95 % interval [-]; None without answers.

    groups: answers of each trial. The bootstrap draws whole trials, since answers about one trial hang
    together.
    """
    if not groups:
        return None
    arrays = [_arrays([group]) for group in groups]
    draws = np.random.default_rng(0).integers(len(groups), size=(BOOTSTRAP_DRAWS, len(groups)))
    errors = []
    for draw in draws:
        drawn = [arrays[index] for index in draw]
        errors.append(expected_calibration_error(*map(np.concatenate, zip(*drawn, strict=True))))
    low, high = np.percentile(errors, [2.5, 97.5])
    value = expected_calibration_error(*_arrays(groups))
    return {"value": value, "low": float(low), "high": float(high)}


def expected_calibration_error(probability: NDArray, right: NDArray) -> float:
    """Expected calibration error [-]; probability and truth of each answer, (answers,) each."""
    off = np.bincount(_bin(probability), weights=probability - right, minlength=BINS)
    return float(np.sum(np.abs(off)) / len(probability))


def results(trials: Sequence[TrialScore], *, seed: int, forms: str) -> dict[str, Any]:
    """Everything that was counted, and each trial: the content of results.json."""
    counted, average = shares(trials), means(trials)
    calibration = {
        name: {
            "answers": sum(map(len, groups)),
            "error": calibration_error(groups),
            "bins": reliability(*_arrays(groups)),
        }
        for name, groups in answers_by_trial(trials).items()
    }
    error = calibration[FIRST]["error"]
    values = {name: found["value"] for name, found in counted.items()} | average
    values[CALIBRATION] = error["value"] if error else None
    asked = CRITERIA if forms == "usual" else {CALIBRATION: CRITERIA[CALIBRATION]}
    return {
        "seed": seed,
        "forms": forms,
        "trials": len(trials),
        "criteria": {
            name: {"value": value, "met": None if value is None else low <= value <= high}
            for name, (low, high) in asked.items()
            for value in [values[name]]
        },
        "shares": counted,
        "means": average,
        "calibration": calibration,
        "each": [{**asdict(trial), "well_judged": is_well_judged(trial)} for trial in trials],
    }


def as_text(found: dict[str, Any]) -> str:
    """The results as lines to read. found: of `results`."""
    lines = [f"Blind check over {found['trials']} trials, {found['forms']} forms", ""]
    for name, counted in found["shares"].items():
        interval = f"{counted['low']:.3f} to {counted['high']:.3f}"
        lines.append(
            f"{name}: {_number(counted['value'])} ({interval}), {counted['hits']} of {counted['of']}"
        )
    lines += [f"{name}: {_number(value)}" for name, value in found["means"].items()]
    lines += ["", "Asked:"]
    for name, criterion in found["criteria"].items():
        low, high = CRITERIA[name]
        asked = f"at least {low:g}" if high == math.inf else f"at most {high:g}"
        met = {None: "not measured", True: "met", False: "missed"}[criterion["met"]]
        lines.append(f"{name} {asked}: {_number(criterion['value'])}, {met}")
    for trial in found["each"]:
        if not trial["well_judged"]:
            causes, named = (" + ".join(trial[key]) or "nothing" for key in ("causes", "named"))
            lines.append(f"trial {trial['number']:04d}: {causes}; {trial['verdict']}, named: {named}")
    return "\n".join(lines)


def reliability_figure(calibration: dict[str, Any]) -> Figure:
    """Share that came true over the stated probability: of first causes, and of each effect."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    for axes, name in zip(figure.subplots(1, 2, sharey=True), (FIRST, INCLUSION), strict=True):
        draw_reliability(axes, calibration[name]["bins"])
        axes.set_title(name)
    figure.axes[1].set_ylabel("")
    return figure


def draw_reliability(axes: Axes, bins: Sequence[dict[str, Any]]) -> None:
    """Draw the share that is true in each bin of `reliability`, with its interval and its answers."""
    axes.plot([0, 1], [0, 1], color="black", linestyle=":")
    for bin_ in bins:
        right, x = bin_["right"], bin_["probability"]
        axes.plot([x, x], [right["low"], right["high"]], color="C0", marker="_")
        axes.plot(x, right["value"], "C0o")
        axes.annotate(str(right["of"]), (x, right["value"]), (5, 3), textcoords="offset points")
    axes.set(xlabel="stated probability", xlim=(-0.03, 1.06), ylim=(-0.03, 1.06))
    axes.set_ylabel("share that is true")
    axes.grid(alpha=0.3)


def _bin(probability: NDArray) -> NDArray:
    """Number of each answer's bin (answers,)."""
    return np.minimum((probability * BINS).astype(int), BINS - 1)


def _arrays(groups: Sequence[Sequence[Answer]]) -> tuple[NDArray, NDArray]:
    """Probabilities and truths of all answers, (answers,) each."""
    answers = [answer for group in groups for answer in group]
    return np.array([a.probability for a in answers]), np.array([a.right for a in answers], dtype=bool)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
