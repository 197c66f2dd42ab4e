"""Whether a cause is to be added: by what it does on recordings that were never fitted to."""

from identification.gap.diagnosis import Diagnosis, hypothesis_label, hypothesis_title
from identification.gap.rank.verdict import RankedCause
from identification.gap.reduce.discrepancy_reduction import RECALIBRATED
from identification.gap.report.quantities import gap_text, listed, probability_text
from identification.gap.report.sentences import share_closed


def add_or_not(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """The advice on a cause that the verdict names."""
    if diagnosis.surely_helps(cause):
        return f"add {listed(cause.hypothesis.titles)}"
    them = "it" if len(cause.effects) == 1 else "them"
    return f"that this helps on recordings never fitted to is not sure, so do not add {them} yet"


def nearest_cause(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """The advice on the nearest cause, which is not the true one as far as one can tell.

    Whether it helps is one question, whether it is true another.
    """
    name, share = hypothesis_title(cause.hypothesis), share_closed(diagnosis, cause)
    if diagnosis.surely_helps(cause):
        true = "it is the true cause" if len(cause.effects) == 1 else "they are the true causes"
        return (
            f"Adding {name} would reduce the gap on recordings never fitted to by {share}, but that "
            f"{true} is doubtful ({probability_text(cause.probability)})."
        )
    gaps = diagnosis.reduction.gaps
    before, after = (
        gaps[RECALIBRATED].overall.value,
        gaps[hypothesis_label(cause.hypothesis)].overall.value,
    )
    if after > before:
        return (
            f"The nearest cause, {name}, makes recordings never fitted to worse (from "
            f"{gap_text(before)} to {gap_text(after)} noise deviations): do not add it."
        )
    return (
        f"The nearest cause, {name}, closes {share} of the gap on recordings never fitted to: do not "
        "add it."
    )
