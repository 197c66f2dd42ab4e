"""What a diagnosis says, in sentences that a project leader can act on."""

from collections.abc import Sequence

from identification.gap.diagnosis import Diagnosis, label
from identification.gap.locate.fault_localisation import Where
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, NO_GAP, Ranked
from identification.gap.reduce.discrepancy_reduction import FELT, NOMINAL, RECALIBRATED
from identification.gap.reduce.gaps import FLOOR
from identification.gap.report.json_export import magnitudes
from identification.gap.report.quantities import chance, gap, interval, quantity, share, spread

AT_END = 1e-6
"""Share of a range within which a number is at its end."""

LIKELY, FAINT = 0.5, 0.01
"""Probabilities above which a thing is said without a second thought, and worth a word at all."""


def verdict(diagnosis: Diagnosis, next_experiment: str) -> tuple[str, str]:
    """Status as the page has it, and the verdict in a sentence or two."""
    conclusion, sure = diagnosis.conclusion, not diagnosis.warnings
    if conclusion.verdict == NO_GAP:
        likely = diagnosis.verdicts.no_cause > LIKELY
        return ("good" if likely and sure else "doubt"), _no_gap(diagnosis)
    if conclusion.verdict == KNOWN:
        complete = not diagnosis.shrinkage.unexplained.still_predictable
        return ("good" if complete and sure else "doubt"), _known(diagnosis)
    if conclusion.verdict == AMBIGUOUS:
        return "doubt", f"{_ambiguous(diagnosis)} {_ended(next_experiment)}".strip()
    return "bad", _unknown(diagnosis)


def _known(diagnosis: Diagnosis) -> str:
    best = diagnosis.conclusion.ambiguity[0]
    single = len(best.effects) == 1
    explain, it = ("explains", "it") if single else ("together explain", "them")
    return (
        f"{' and '.join(best.found.name)} {explain} the gap ({chance(best.probability)}): adding {it} "
        f"with {_fitted(best)} closes {closed(diagnosis, best)} of it on recordings never fitted to; "
        f"{_left(diagnosis)}."
    )


def _ambiguous(diagnosis: Diagnosis) -> str:
    rivals = diagnosis.conclusion.ambiguity
    labels = [cause.found.name for cause in rivals]
    common = [name for name in labels[0] if all(name in others for others in labels)]
    rests = [" + ".join(name for name in own if name not in common) for own in labels]
    names = " or ".join(
        f"{rest or 'nothing else'} ({chance(cause.probability)})"
        for rest, cause in zip(rests, rivals, strict=True)
    )
    together = f"{' and '.join(common)} together with " if common else ""
    shares = " or ".join(dict.fromkeys(closed(diagnosis, cause) for cause in rivals))
    doubt = "which" if all(rests) else "whether another cause acts or the form of the first one errs"
    return (
        f"{together}{names} explains the gap and closes {shares} of it; these recordings cannot tell "
        f"{doubt}."
    )


def _no_gap(diagnosis: Diagnosis) -> str:
    gaps, none = diagnosis.shrinkage.gaps, diagnosis.verdicts.no_cause
    recalibrated = gaps[RECALIBRATED].overall
    text = (
        "There is no gap beyond noise after recalibration"
        if recalibrated.low <= FLOOR + FELT
        else "Recalibration leaves a small gap of which no cause can be named"
    )
    text += (
        f": the model misses recordings never fitted to by {spread(recalibrated)} noise deviations, "
        f"{gap(gaps[NOMINAL].overall.value)} before. Use the recalibrated parameters and add nothing."
    )
    return text if none > LIKELY else f"{text} {_faint(diagnosis)}"


def _faint(diagnosis: Diagnosis) -> str:
    """What may be there all the same, and why it is not named."""
    verdicts = diagnosis.verdicts
    found = {label(cause.found): cause.probability for cause in diagnosis.conclusion.causes}
    found["something outside the catalogue"] = verdicts.unknown
    name = max(found, key=found.__getitem__)
    return (
        f"In doubt: {name} may act ({chance(found[name])}), but that no cause acts "
        f"({chance(verdicts.no_cause)}) cannot be ruled out."
    )


def _unknown(diagnosis: Diagnosis) -> str:
    text = (
        f"Nothing in the catalogue explains the gap ({chance(diagnosis.verdicts.unknown)}): something "
        f"is missing, most likely in {place(diagnosis)}"
        f"{', see its shape' if diagnosis.where.shape else ''}."
    )
    if not diagnosis.best:
        return text
    nearest = f"The nearest cause, {label(diagnosis.best.found)}, closes"
    return f"{text} {nearest} {closed(diagnosis, diagnosis.best)} of the gap only: do not add it."


def place(diagnosis: Diagnosis) -> str:
    """The component that is most probably at fault, and its likeliest equation or reading."""
    component, probability = next(iter(diagnosis.conclusion.component.items()))
    where = diagnosis.where
    own = [f.equation.name for f in where.forcings if f.equation.component == component]
    equation = max(own, key=lambda name: where.equation[name], default="")
    return f"{component.replace('_', ' ')} ({f'{equation}, ' if equation else ''}{chance(probability)})"


def located(diagnosis: Diagnosis) -> str:
    """Where most of the gap lies."""
    worst = max(diagnosis.where.regimes, key=lambda found: found.gap)
    text = (
        f"After recalibration the gap is largest in {worst.channel} during "
        f"{worst.regime.replace('_', ' ')}: {gap(worst.gap)} noise deviations, {FLOOR:g} is noise alone."
    )
    if diagnosis.conclusion.verdict == NO_GAP:
        return text
    return f"{text} Most likely at fault: {place(diagnosis)}."


def beside(diagnosis: Diagnosis, left: Where) -> str:
    """What the nearest cause leaves, where it does not suffice."""
    name = label(diagnosis.best.found) if diagnosis.best else RECALIBRATED
    equation, probability = max(left.equation.items(), key=lambda item: item[1])
    return f"Even with {name}, {equation} lacks something ({chance(probability)})."


def shrunk(diagnosis: Diagnosis) -> str:
    """The gap from the nominal model to the black box."""
    gaps = diagnosis.shrinkage.gaps
    models = {"nominal": gaps[NOMINAL], "recalibrated": gaps[RECALIBRATED]}
    if diagnosis.best:
        name = label(diagnosis.best.found)
        models[f"with {name}"] = gaps[name]
    models["with a black box on top of recalibration"] = diagnosis.shrinkage.black_box_floor
    found = "; ".join(f"{name} {spread(model.overall)}" for name, model in models.items())
    return f"Gap on recordings never fitted to, in noise deviations ({FLOOR:g} is noise alone): {found}."


def hidden(diagnosis: Diagnosis) -> str:
    """Causes that the recordings cannot show, whatever the residual."""
    absorbed = diagnosis.verdicts.separability.absorbed
    if not absorbed:
        return "At its usual size every cause of the catalogue would show in these recordings."
    return (
        f"At the usual size these recordings would not show {', '.join(absorbed)}: recalibration, "
        f"starts and the scatter of units take it up. Of these the diagnosis says nothing."
    )


def alike(diagnosis: Diagnosis, cause: Ranked) -> str:
    """What these recordings hardly tell from a cause or its parts, with the signatures' correlation."""
    separability = diagnosis.verdicts.separability
    place = separability.labels.index
    found = [
        f"{twin} ({abs(separability.correlation[place(name), place(twin)]):.3f})"
        for name in cause.found.name
        for twin in separability.twins(name)
    ]
    return ", ".join(found) or "-"


def ends(diagnosis: Diagnosis) -> list[str]:
    """Fitted numbers at an end of their physical range, after recalibration and of probable causes."""
    fitter = diagnosis.verdicts.fitter
    points = {RECALIBRATED: diagnosis.verdicts.none.point}
    points |= {label(cause.found): cause.found.point for cause in probable(diagnosis.judged)}
    return [
        f"{name}: {size.symbol} is at an end of its physical range ({quantity(value, size.unit)})"
        for name, point in points.items()
        for size in (*fitter.plant.parameters, *point.hypothesis.sizes)
        for value in [fitter.values(point)[size.symbol]]
        if min(abs(value - size.low), abs(value - size.high)) <= AT_END * abs(size.high - size.low)
    ]


def probable(causes: Sequence[Ranked]) -> list[Ranked]:
    """Those that are worth a word."""
    return [cause for cause in causes if cause.probability >= FAINT]


def closed(diagnosis: Diagnosis, cause: Ranked) -> str:
    """The share of the gap that a cause closes."""
    return share(diagnosis.shrinkage.shrink[label(cause.found)])


def fitted(cause: Ranked) -> list[str]:
    """Each size of a cause with its 90 % interval."""
    pairs = zip(cause.found.point.hypothesis.sizes, magnitudes(cause.found).values(), strict=True)
    return [f"{size.symbol} = {interval(*found, size.unit)}" for size, found in pairs]


def _fitted(cause: Ranked) -> str:
    pairs = zip(cause.found.point.hypothesis.sizes, magnitudes(cause.found).values(), strict=True)
    return " and ".join(f"{size.symbol} = {quantity(found[0], size.unit)}" for size, found in pairs)


def _left(diagnosis: Diagnosis) -> str:
    unexplained = diagnosis.shrinkage.unexplained
    if not unexplained.still_predictable:
        return "nothing predictable is left"
    return (
        f"{100 * unexplained.fraction:.0f} % of it is left and still predictable, so something smaller "
        f"is missing too"
    )


def _ended(text: str) -> str:
    return text if not text or text.endswith(".") else f"{text}."
