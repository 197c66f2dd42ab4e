"""The whole diagnosis of a grey-box plant: which cause, where, and how far the gap shrinks."""

from dataclasses import dataclass

from identification.gap.fit.fit_cache import Fits
from identification.gap.fit.fitter import Hypothesis, Point
from identification.gap.locate.fault_localisation import Where, locate
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.evidence import Assessed
from identification.gap.rank.predictive_check import second_look
from identification.gap.rank.ranking import Verdicts, which
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, UNKNOWN, Conclusion, Ranked, conclude
from identification.gap.reduce.discrepancy_reduction import NOMINAL, RECALIBRATED, Shrinkage, shrinkage

RUNNERS_UP = 3
"""Single causes beyond the ambiguity set whose shrinking is judged too."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Everything that one diagnosis found."""

    verdicts: Verdicts
    conclusion: Conclusion
    where: Where
    """Of what recalibration leaves."""
    left: Where | None
    """Of what the best cause leaves, where that is to be explained; else None."""
    shrinkage: Shrinkage
    nominal: Point
    judged: list[Ranked]
    """Causes that `shrinkage` knows by their label."""
    warnings: list[str]

    @property
    def best(self) -> Ranked | None:
        """The cause that the verdict names, or the one that comes closest; None where none is needed."""
        named = self.conclusion.verdict in (KNOWN, AMBIGUOUS, UNKNOWN)
        return self.judged[0] if named and self.judged else None


def label(found: Assessed) -> str:
    """A hypothesis in one line."""
    return " + ".join(found.name)


def diagnose(plant: GreyBox, *, seed: int = 0, fits: Fits | None = None) -> Diagnosis:
    """Diagnose the plant's recordings.

    seed: of the bootstrap. fits: runs and remembers the fits. Raises ValueError where no run is held
    out.
    """
    if not any(run.held_out for run in plant.runs):
        raise ValueError(
            "no recording is held out: a gap is judged on recordings never fitted to; give one the role "
            "'validation'"
        )
    fits = fits or Fits(plant)
    verdicts = which(plant, fits)
    fitter, none = verdicts.fitter, verdicts.none
    fits.say("where")
    where = locate(fitter, none.point, none.residuals, seed)
    fits.say("how far it shrinks")
    found = _judged(verdicts, where, seed)
    reconsidered = second_look(verdicts, found.conclusion.verdict, found.shrinkage.unexplained)
    return found if reconsidered is verdicts else _judged(reconsidered, where, seed)


def _judged(verdicts: Verdicts, where: Where, seed: int) -> Diagnosis:
    """What probabilities amount to, and how far the causes that count close the gap."""
    fitter, none = verdicts.fitter, verdicts.none
    conclusion = conclude(verdicts, where)
    first = max(len(conclusion.ambiguity), 1)
    others = [cause for cause in conclusion.causes[first:] if len(cause.effects) == 1]
    judged = [*conclusion.causes[:first], *others[:RUNNERS_UP]]
    left = None
    if conclusion.verdict == UNKNOWN and judged:
        best = judged[0].found
        left = locate(fitter, best.point, best.residuals, seed)
    nominal = fitter.start(Hypothesis(causes=()), {})
    points = {NOMINAL: nominal, RECALIBRATED: none.point}
    points |= {label(cause.found): cause.found.point for cause in judged}
    return Diagnosis(
        verdicts=verdicts,
        conclusion=conclusion,
        where=where,
        left=left,
        shrinkage=shrinkage(fitter, points, seed=seed),
        nominal=nominal,
        judged=judged,
        warnings=_warnings(none, judged),
    )


def _warnings(none: Assessed, judged: list[Ranked]) -> list[str]:
    """What did not go as it should."""
    found = [] if none.converged else ["the recalibration did not converge: its gap may be too large"]
    return found + [
        f"the fit of {label(cause.found)} did not converge: its size and probability are in doubt"
        for cause in judged
        if not cause.found.converged and cause.probability > 0.01
    ]
