"""The diagnosis in sentences that a project leader can act on."""

from dataclasses import replace

from identification.gap.diagnosis import MENTIONED_PROBABILITY, Diagnosis
from identification.gap.fit.gaps import FLOOR
from identification.gap.fit.laws import in_words as laws_in_words
from identification.gap.judge.held_out import LEAST_GAP_CLOSED, NOMINAL, RECALIBRATED
from identification.gap.judge.verdict import (
    AMBIGUOUS,
    FAR_ABOVE_NOISE,
    KNOWN,
    NO_GAP,
    PARTIAL,
    RankedCause,
)
from identification.gap.locate.localisation import Localisation
from identification.gap.plant import FreeParameter
from identification.gap.report.gap_json import discrepancy, remainder, share_left
from identification.gap.report.quantities import (
    gap_text,
    gap_with_interval,
    listed,
    probability_text,
    quantity,
    share_text,
)

LIKELY_PROBABILITY = 0.5
"""Probability above which the report states no gap without reservation."""

MENTIONED_DISCREPANCY = 0.3
"""Standard deviation of a disturbance [noise deviations] from which the verdict mentions it: less adds
under 5 % to the readings' scatter."""

BOUND_TOLERANCE = 1e-6
"""Share of a range [1] within which a parameter is reported as lying at the end of its range."""


def verdict_sentence(diagnosis: Diagnosis, next_experiment: str) -> tuple[str, str]:
    """Status for the page ('good', 'doubt' or 'bad'), and the verdict in a few sentences.

    next_experiment: a sentence for an ambiguous verdict; empty where none was sought.
    """
    status, text = _status_and_text(diagnosis, next_experiment)
    for label, onset in diagnosis.onsets_of(diagnosis.best).items() if diagnosis.best else ():
        end = f" and is mended in {onset.mended}" if onset.mended else ""
        text += (
            f" {in_words(diagnosis, label)} begins with {onset.drive}{end} "
            f"({probability_text(onset.probability)})."
        )
    return status, text


def _status_and_text(diagnosis: Diagnosis, next_experiment: str) -> tuple[str, str]:
    """`verdict_sentence` but for the onset."""
    conclusion, no_warning = diagnosis.conclusion, not diagnosis.warnings
    if conclusion.verdict == NO_GAP:
        likely = diagnosis.ranking.no_cause > LIKELY_PROBABILITY
        good = likely and no_warning and not _far_above_noise(diagnosis)
        text = f"{_no_gap(diagnosis)} {hidden_causes_sentence(diagnosis)}"
        return ("good" if good else "doubt"), text
    if conclusion.verdict == KNOWN:
        helps = diagnosis.surely_helps(diagnosis.judged[0])
        good = helps and no_warning and diagnosis.reduction.left.overall.value <= FAR_ABOVE_NOISE
        return ("good" if good else "doubt"), _known(diagnosis)
    if conclusion.verdict == AMBIGUOUS:
        stop = "." if next_experiment and not next_experiment.endswith(".") else ""
        return "doubt", f"{_ambiguous(diagnosis)} {next_experiment}{stop}".strip()
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
    laws = best.hypothesis.estimate.laws
    other = f" The law differs from the one assumed: {laws_in_words(laws)}." if laws else ""
    left = diagnosis.reduction.left.overall.value
    rest = (
        f"{gap_text(left)} noise deviations are left, which nothing predicts from the inputs"
        if left > FAR_ABOVE_NOISE
        else "nothing predictable is left"
    )
    return f"{text}; {rest}.{other}"


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
    look = ", and look at the missing term" if left and left.missing_term else ""
    named = listed([in_words(diagnosis, name) for name in held])
    return (
        f"{named} {are} part of the gap ({chances}): adding {them}{together} with "
        f"{sizes_text(diagnosis, best)} closes {share_closed(diagnosis, best)} of it on recordings "
        f"never fitted to. {share_text(share_left(diagnosis))} remains{remainder_place(left)}: "
        f"{add_or_not(diagnosis, best)}{look}."
    )


def _ambiguous(diagnosis: Diagnosis) -> str:
    rivals = diagnosis.conclusion.ambiguity_set
    labels = [cause.hypothesis.titles for cause in rivals]
    common = [label for label in labels[0] if all(label in others for others in labels)]
    rests = [" + ".join(label for label in own if label not in common) for own in labels]
    named = [f"with {rest}" if rest else "alone" for rest in rests] if common else rests
    choices = " or ".join(
        f"{name} ({probability_text(cause.probability)})"
        for name, cause in zip(named, rivals, strict=True)
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


def _no_gap(diagnosis: Diagnosis) -> str:
    gaps = diagnosis.reduction.gaps
    recalibrated = gaps[RECALIBRATED].overall
    disturbance = disturbance_sentence(diagnosis)
    if _far_above_noise(diagnosis):
        text = (
            "Nothing in what recalibration leaves can be predicted from the inputs, so no cause is named"
        )
        disturbance += (
            "A cause that acts at random, or one that only repeated recordings show, is not ruled out. "
        )
    elif disturbance:
        text = "There is no gap beyond noise and disturbances after recalibration"
    elif recalibrated.low <= FLOOR + LEAST_GAP_CLOSED:
        text = "There is no gap beyond noise after recalibration"
    else:
        text = "Recalibration leaves a small gap of which no cause can be named"
    text += (
        f": on recordings never fitted to, the gap is {gap_with_interval(recalibrated)} noise "
        f"deviations, and {gap_text(gaps[NOMINAL].overall.value)} before. {disturbance}Use the "
        "recalibrated parameters and add nothing."
    )
    likely = diagnosis.ranking.no_cause > LIKELY_PROBABILITY
    return text if likely else f"{text} {_possible_cause(diagnosis)}"


def _far_above_noise(diagnosis: Diagnosis) -> bool:
    """Whether the gap stands far above the stated noise, so that no word may reassure."""
    gap = diagnosis.reduction.gaps[RECALIBRATED].overall
    seen = max(diagnosis.reduction.noise_ratios.values())
    return gap.value * max(seen, 1.0) > FAR_ABOVE_NOISE


def _possible_cause(diagnosis: Diagnosis) -> str:
    """The cause that may act all the same, and why the verdict does not name it."""
    ranking = diagnosis.ranking
    probabilities = {cause.hypothesis.title: cause.probability for cause in diagnosis.conclusion.causes}
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
    name, share = cause.hypothesis.title, share_closed(diagnosis, cause)
    advised = diagnosis.advised
    if advised:
        title = advised.hypothesis.title
        return (
            f"Add {title} all the same: it closes {share_closed(diagnosis, advised)} of the gap on "
            f"recordings never fitted to, though its name is doubtful "
            f"({probability_text(advised.probability)})."
        )
    if diagnosis.surely_helps(cause):
        true = "it is the true cause" if len(cause.effects) == 1 else "they are the true causes"
        return (
            f"Adding {name} would reduce the gap on recordings never fitted to by {share}, but that "
            f"{true} is doubtful ({probability_text(cause.probability)})."
        )
    gaps, held_out = diagnosis.reduction.gaps, "recordings never fitted to"
    before, after = (gaps[label].overall.value for label in (RECALIBRATED, cause.hypothesis.label))
    effect = f"closes {share} of the gap on {held_out}"
    if after > before:
        ends = f"from {gap_text(before)} to {gap_text(after)} noise deviations"
        effect = f"makes {held_out} worse ({ends})"
    return f"The nearest cause, {name}, {effect}: do not add it."


def remainder_place(left: Localisation | None) -> str:
    """Where the remainder lies, as the end of a clause; empty where the recordings do not show it."""
    if not left or not left.forcings:
        return ""
    equation = left.likeliest.equation
    probability = left.equation_probabilities[equation.name]
    if probability <= left.nothing_missing:
        return ""
    place = f"{equation.title} of {equation.component.replace('_', ' ')}"
    return f", most likely in {place} ({probability_text(probability)})"


def disturbance_sentence(diagnosis: Diagnosis) -> str:
    """Disturbances that are seen beside the noise, with a blank at the end; empty where none is seen."""
    ranking, seen = diagnosis.ranking, discrepancy(diagnosis)
    channels = zip(ranking.problem.plant.channels, ranking.noise, strict=True)
    texts = [
        f"{quantity(seen[channel.name]['sd'], channel.unit)} in {channel.name}, correlated over "
        f"{quantity(seen[channel.name]['time_scale_s'], 's')}"
        for channel, own in channels
        if own.sd >= MENTIONED_DISCREPANCY
    ]
    if not texts:
        return ""
    are = "is a disturbance" if len(texts) == 1 else "are disturbances"
    return f"Beside the noise there {are} of {listed(texts)}, that no model input explains. "


def component_at_fault(diagnosis: Diagnosis) -> str:
    """The component that is most probably at fault, and its likeliest equation or reading."""
    component, probability = next(iter(diagnosis.conclusion.component_probabilities.items()))
    localisation = diagnosis.localisation
    own = [f.equation for f in localisation.forcings if f.equation.component == component]
    own.sort(key=lambda equation: -localisation.equation_probabilities[equation.name])
    named = "".join(f", {equation.title}" for equation in own[:1])
    return f"{component.replace('_', ' ')}{named} ({probability_text(probability)})"


def hidden_causes_sentence(diagnosis: Diagnosis) -> str:
    """Causes that the recordings cannot show, whatever the residual."""
    hidden, flow = diagnosis.ranking.separability.absorbed, diagnosis.as_consumption
    absorbed = [in_words(diagnosis, label) for label in hidden if label not in flow]
    alike = ", ".join(in_words(diagnosis, label) for label in flow)
    if not (absorbed or flow):
        return "At its usual size every cause of the catalogue would show in these recordings."
    text = (
        f"Absorbed at the usual size, neither seen nor ruled out: {', '.join(absorbed) or 'none'}, by "
    )
    text += "recalibration, run offsets and the scatter of units"
    return f"{text}; {alike}, the same as consumption." if flow else f"{text}."


def look_alikes(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """Causes that the recordings hardly tell from one cause, with the signatures' correlation."""
    separability = diagnosis.ranking.separability
    place = separability.labels.index
    twins = [
        f"{in_words(diagnosis, twin)} ({abs(separability.correlation[place(label), place(twin)]):.3f})"
        for label in cause.hypothesis.labels
        for twin in separability.twins(label)
    ]
    return ", ".join(twins) or "-"


def parameters_at_bounds(diagnosis: Diagnosis) -> list[str]:
    """Fitted parameters at an end of their physical range, after recalibration and of likely causes."""
    problem = diagnosis.ranking.problem
    estimates = {RECALIBRATED: diagnosis.ranking.recalibrated.estimate}
    estimates |= {
        cause.hypothesis.title: cause.hypothesis.estimate
        for cause in diagnosis.judged
        if cause.probability >= MENTIONED_PROBABILITY
    }
    found = [
        f"{name}: {p.title} is at an end of its physical range ({quantity(value, p.unit)})"
        for name, estimate in estimates.items()
        for p in (*problem.plant.parameters, *estimate.hypothesis.cause_parameters)
        for value in [problem.values(estimate)[p.symbol]]
        if at_an_end(p, value)
    ]
    return found + [
        f"{name}: its strength may follow {law.argument} even more than the fit allows"
        for name, estimate in estimates.items()
        for law, components in estimate.laws
        if any(at_an_end(p, z) for p, z in zip(law.parameters, components, strict=True))
    ]


def at_an_end(parameter: FreeParameter, value: float) -> bool:
    """Whether a value [SI] lies at an end of its parameter's physical range."""
    apart = min(abs(value - parameter.low), abs(value - parameter.high))
    return apart <= BOUND_TOLERANCE * abs(parameter.high - parameter.low)


def share_closed(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """The share of the gap that a cause closes, with its interval."""
    return share_text(diagnosis.share_closed(cause))


def sizes_text(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """Each fitted parameter of a cause, without its interval."""
    values = diagnosis.ranking.problem.values(cause.hypothesis.estimate)
    return " and ".join(
        f"{p.title} = {quantity(values[p.symbol], p.unit)}"
        for p in cause.hypothesis.estimate.hypothesis.cause_parameters
    )


def in_words(diagnosis: Diagnosis, label: str) -> str:
    """A cause's name or label, or several joined by ' + ', for people; any other text unchanged."""
    words = {}
    for cause in diagnosis.ranking.problem.plant.causes:
        words |= {cause.name: replace(cause, variant="").title, cause.label: cause.title}
    return " + ".join(words.get(part, part) for part in label.split(" + "))
