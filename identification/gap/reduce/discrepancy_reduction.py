"""How far the gap shrinks on held-out runs: nominal, recalibrated, with each cause, black-box ceiling.

Every model is treated alike: tolerances as the fitted runs tell them, each run with its own start, the
same draws of the block bootstrap. A start may follow what a model lacks; so the interval of a share also
holds what is found when every run begins as it was recorded.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from identification.gap.fit.fitter import Fitter, Point
from identification.gap.fit.prediction import percent, predict
from identification.gap.reduce.black_box import Learner, learnt, ridge
from identification.gap.reduce.block_bootstrap import Interval
from identification.gap.reduce.gaps import FLOOR, Draws, Gap
from identification.gap.reduce.predictability import p_value

NOMINAL, RECALIBRATED = "nominal", "recalibrated"
"""Labels of the two models without a cause."""

SIGNIFICANT = 0.01
"""Probability of a prediction as good as found where there is nothing to predict."""

FELT, MATERIAL = 0.02, 0.05
"""Gap that a prediction must close to count: in noise deviations, and as a share of the explainable."""


@dataclass(frozen=True, kw_only=True)
class Unexplained:
    """What the best cause leaves."""

    fraction: float
    """Of the explainable gap; 0 where the recalibrated model may be at the floor."""
    predictable: float
    """Share of the mean square above the floor that the black box predicts on held-out runs."""
    p_value: float
    """Of that prediction, against blocks of the residual in another order."""
    still_predictable: bool
    """The prediction is significant and closes a gap that matters."""


@dataclass(frozen=True, kw_only=True)
class Shrinkage:
    """How far each model is from the held-out runs, and what each cause closes of it."""

    gaps: Mapping[str, Gap]
    """By label: 'nominal', 'recalibrated', the causes."""
    shrink: Mapping[str, Interval]
    """By cause: the share of the explainable gap that it closes, 0 to 1."""
    black_box_floor: Gap
    """The recalibrated model with the black box on top."""
    unexplained: Unexplained
    """By the first cause; by the recalibrated model where there is none."""
    noise: Mapping[str, float]
    """By channel: the noise deviation that gaps are in, relative to `Channel.noise`."""


def shrinkage(
    fitter: Fitter, points: Mapping[str, Point], black_box: Learner = ridge, seed: int = 0
) -> Shrinkage:
    """Judge fitted points on the held-out runs.

    points: 'nominal', 'recalibrated' and the causes by label, the best cause first. Raises ValueError
    where no run is held out.
    """
    plant = fitter.plant
    if not any(run.held_out for run in plant.runs):
        raise ValueError("no run is held out: how far a gap shrinks is judged on runs never fitted to")
    found = {label: predict(fitter, point) for label, point in points.items()}
    causes = [label for label in points if label not in (NOMINAL, RECALIBRATED)]
    best = (*causes, RECALIBRATED)[0]
    boxes = {label: learnt(plant, found[label], black_box, seed) for label in {RECALIBRATED, best}}
    residuals = {label: prediction.residuals for label, prediction in found.items()}
    boxed = {
        f"{label} + black box": [y - p for y, p in zip(residuals[label], box, strict=True)]
        for label, box in boxes.items()
    }
    recorded = {_recorded(label): prediction.as_recorded for label, prediction in found.items()}
    draws = Draws(plant, {**residuals, **boxed, **recorded}, seed)
    return Shrinkage(
        gaps={label: draws.gap(label, percent(plant, found[label].outputs)) for label in points},
        shrink={
            label: draws.share(RECALIBRATED, label, (_recorded(RECALIBRATED), _recorded(label)))
            for label in causes
        },
        black_box_floor=draws.gap(f"{RECALIBRATED} + black box"),
        unexplained=_unexplained(draws, best, p_value(plant, residuals[best], boxes[best], seed)),
        noise={c.name: float(n) for c, n in zip(plant.channels, draws.noise[0], strict=True)},
    )


def _recorded(label: str) -> str:
    return f"{label}, starts as recorded"


def _unexplained(draws: Draws, best: str, significance: float) -> Unexplained:
    """What a model leaves above the floor, and what the black box finds in it."""
    recalibrated = draws.gap(RECALIBRATED).overall
    left, boxed = draws.overall(best)[0], draws.overall(f"{best} + black box")[0]
    explainable = max(recalibrated.value - FLOOR, 0.0)
    above, predicted = left**2 - FLOOR**2, left**2 - boxed**2
    return Unexplained(
        fraction=_share(left - FLOOR, explainable) if recalibrated.low > FLOOR else 0.0,
        predictable=_share(predicted, above),
        p_value=significance,
        still_predictable=bool(
            significance < SIGNIFICANT and left - boxed > max(FELT, MATERIAL * explainable)
        ),
    )


def _share(part: float, whole: float) -> float:
    """Between 0 and 1; 0 of nothing."""
    return float(min(max(part / whole, 0.0), 1.0)) if whole > 0 else 0.0
