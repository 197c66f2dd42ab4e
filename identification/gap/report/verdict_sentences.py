"""The verdict of a diagnosis in sentences that a project leader can act on."""

from collections.abc import Sequence

from identification.gap.diagnosis import Diagnosis, hypothesis_title
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, NO_GAP, PARTIAL
from identification.gap.reduce.discrepancy_reduction import NOMINAL, RECALIBRATED
from identification.gap.reduce.gaps import FLOOR
from identification.gap.report.advice_sentences import add_or_not, nearest_cause
from identification.gap.report.names import in_words
from identification.gap.report.quantities import (
    gap_text,
    gap_with_interval,
    listed,
    probability_text,
    share_text,
)
from identification.gap.report.remainder import remainder
from identification.gap.report.remainder_sentences import disturbance_sentence, remainder_place
from identification.gap.report.sentences import component_at_fault, share_closed, sizes_text


def verdict_sentence(diagnosis: Diagnosis, next_experiment: str) -> tuple[str, str]:
    """Status for the page ('good', 'doubt' or 'bad'), and the verdict in a few sentences.

    next_experiment: a sentence for an ambiguous verdict; empty where none was sought.
    """
    conclusion, no_warning = diagnosis.conclusion, not diagnosis.warnings
    if conclusion.verdict == NO_GAP:
        likely = diagnosis.ranking.no_cause > diagnosis.settings.report.likely_probability
        return ("good" if likely and no_warning else "doubt"), _no_gap(diagnosis)
    if conclusion.verdict == KNOWN:
        complete = not diagnosis.reduction.unexplained.still_predictable
        helps = diagnosis.surely_helps(diagnosis.judged[0])
        return ("good" if complete and helps and no_warning else "doubt"), _known(diagnosis)
    if conclusion.verdict == AMBIGUOUS:
        return "doubt", f"{_ambiguous(diagnosis)} {_with_full_stop(next_experiment)}".strip()
    if conclusion.verdict == PARTIAL:
        return "doubt", _partial(diagnosis)
    return "bad", _unknown(diagnosis)


def _known(diagnosis: Diagnosis) -> str:
    best = diagnosis.conclusion.ambiguity_set[0]
    single = len(best.effects) == 1
    explain, them = ("explains", "it") if single else ("together explain", "them")
    text = (
        f"{listed(best.hypothesis.titles)} {explain} the gap "
        f"({probability_text(best.probability)}): adding {them} with {sizes_text(diagnosis, best)} "
        f"closes {share_closed(diagnosis, best)} of the gap on recordings never fitted to"
    )
    if not diagnosis.surely_helps(best):
        return f"{text}: {add_or_not(diagnosis, best)}."
    return f"{text}; {_rest(diagnosis)}."


def _rest(diagnosis: Diagnosis) -> str:
    """What a known cause leaves."""
    if not diagnosis.reduction.unexplained.still_predictable:
        return "nothing predictable is left"
    left = remainder(diagnosis)
    return (
        f"{share_text(left.share)} of the gap is left and still predictable{remainder_place(left)}, so "
        "something smaller is missing too"
    )


def _partial(diagnosis: Diagnosis) -> str:
    """Effects that are surely there, what they close, and what remains."""
    best, held = diagnosis.conclusion.ambiguity_set[0], diagnosis.conclusion.held
    inclusion = diagnosis.ranking.inclusion
    chances = ", ".join(probability_text(inclusion[name]) for name in held)
    are, them = ("is", "it") if len(held) == 1 else ("are", "them")
    faint = [
        f"{in_words(diagnosis, name)} ({probability_text(inclusion[name])})"
        for name in best.effects
        if name not in held
    ]
    together = f" together with {listed(faint)}, less sure," if faint else ""
    left = remainder(diagnosis)
    drawn = left.location and left.location.missing_term
    look = ", and look at the missing term" if drawn else ""
    named = listed([in_words(diagnosis, name) for name in held])
    return (
        f"{named} {are} part of the gap ({chances}): adding {them}{together} with "
        f"{sizes_text(diagnosis, best)} closes {share_closed(diagnosis, best)} of it on recordings "
        f"never fitted to. {share_text(left.share)} remains{remainder_place(left)}: "
        f"{add_or_not(diagnosis, best)}{look}."
    )


def _ambiguous(diagnosis: Diagnosis) -> str:
    rivals = diagnosis.conclusion.ambiguity_set
    labels = [cause.hypothesis.titles for cause in rivals]
    common = [label for label in labels[0] if all(label in others for others in labels)]
    rests = [" + ".join(label for label in own if label not in common) for own in labels]
    choices = " or ".join(
        f"{_beside(rest, common)} ({probability_text(cause.probability)})"
        for rest, cause in zip(rests, rivals, strict=True)
    )
    explain, close = ("explain", "close") if len(common) > 1 else ("explains", "closes")
    text = (
        f"{listed(common)} {explain} the gap, {choices}," if common else f"{choices} {explain} the gap"
    )
    shares = " or ".join(dict.fromkeys(share_closed(diagnosis, cause) for cause in rivals))
    doubt = "which" if all(rests) else "whether another cause acts or the form of the first one errs"
    text += f" and {close} {shares} of it; these recordings cannot tell {doubt}."
    if any(diagnosis.surely_helps(cause) for cause in rivals):
        return text
    return f"{text} None of them surely helps on recordings never fitted to: add none yet."


def _beside(rest: str, common: Sequence[str]) -> str:
    """What a rival adds to the causes that all rivals share."""
    if not common:
        return rest
    return f"with {rest}" if rest else "alone"


def _no_gap(diagnosis: Diagnosis) -> str:
    gaps, settings = diagnosis.reduction.gaps, diagnosis.settings
    recalibrated = gaps[RECALIBRATED].overall
    disturbance = disturbance_sentence(diagnosis)
    if disturbance:
        text = "There is no gap beyond noise and disturbances after recalibration"
    elif recalibrated.low <= FLOOR + settings.reduction.least_gap_closed:
        text = "There is no gap beyond noise after recalibration"
    else:
        text = "Recalibration leaves a small gap of which no cause can be named"
    text += (
        f": on recordings never fitted to, the gap is {gap_with_interval(recalibrated)} noise "
        f"deviations, and {gap_text(gaps[NOMINAL].overall.value)} before. {disturbance}Use the "
        "recalibrated parameters and add nothing."
    )
    likely = diagnosis.ranking.no_cause > settings.report.likely_probability
    return text if likely else f"{text} {_possible_cause(diagnosis)}"


def _possible_cause(diagnosis: Diagnosis) -> str:
    """The cause that may act all the same, and why the verdict does not name it."""
    ranking = diagnosis.ranking
    probabilities = {
        hypothesis_title(cause.hypothesis): cause.probability for cause in diagnosis.conclusion.causes
    }
    probabilities["something outside the catalogue"] = ranking.unknown
    name = max(probabilities, key=probabilities.__getitem__)
    return (
        f"In doubt: {name} may act ({probability_text(probabilities[name])}), but that no cause acts "
        f"({probability_text(ranking.no_cause)}) cannot be ruled out."
    )


def _unknown(diagnosis: Diagnosis) -> str:
    unknown = diagnosis.ranking.unknown
    found = (
        f"Nothing in the catalogue explains the gap ({probability_text(unknown)}): something is missing"
        if unknown > 0.5
        else "No cause in the catalogue is probable enough to be named: it may be one of them, or "
        f"something that is missing ({probability_text(unknown)})"
    )
    text = (
        f"{found}, most likely in {component_at_fault(diagnosis)}"
        f"{', see its shape' if diagnosis.localisation.missing_term else ''}."
    )
    return f"{text} {nearest_cause(diagnosis, diagnosis.best)}" if diagnosis.best else text


def _with_full_stop(text: str) -> str:
    return text if not text or text.endswith(".") else f"{text}."
