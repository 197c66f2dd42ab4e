"""The diagnosis in sentences that a project leader can act on; verdict.jinja has their words."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from epv_env.common.units import plain_powers
from identification.block_bootstrap import Interval
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.gaps import FLOOR
from identification.gap.fit.laws import AS_ASSUMED
from identification.gap.judge.held_out import LEAST_GAP_CLOSED, RECALIBRATED
from identification.gap.judge.verdict import NO_GAP, UNKNOWN, RankedCause
from identification.gap.locate.localisation import Localisation
from identification.gap.plant import FreeParameter, StateEquation
from identification.gap.report.gap_json import discrepancy, form_in_words, remainder, share_left
from identification.report.page import templates

MENTIONED_DISCREPANCY = 0.3
"""Standard deviation of a disturbance [noise deviations] from which the verdict mentions it: less adds
under 5 % to the readings' scatter."""

FAR_ABOVE_NOISE = 1.5
"""Gap that no word may call small [noise deviations]: twice the noise's variance."""

BOUND_TOLERANCE = 1e-6
"""Share of a range [1] within which a parameter is reported as lying at the end of its range."""


@dataclass(frozen=True, kw_only=True)
class Words:
    """What a diagnosis says, in sentences."""

    status: str
    """'good', 'doubt' or 'bad': a status of the page."""
    what: str
    """The verdict with the advice."""
    doubts: tuple[str, ...]
    """Why it is in doubt; empty where it is good."""
    where: str
    """The component that is most probably at fault."""
    hidden: str
    """Causes that the recordings cannot show, whatever the residual."""


def verdict_sentence(diagnosis: Diagnosis) -> tuple[str, str]:
    """Status ('good', 'doubt' or 'bad'), and the verdict with the reasons of its doubt."""
    words = words_of(diagnosis)
    hidden = [words.hidden] if diagnosis.conclusion.verdict == NO_GAP else []
    return words.status, " ".join([words.what, *hidden, *words.doubts])


def words_of(diagnosis: Diagnosis) -> Words:
    """All that the report says."""
    environment = templates(autoescape=False)
    environment.filters |= {
        "probability": probability_text,
        "share": share_text,
        "gap": gap_text,
        "gap_with_interval": gap_with_interval,
        "listed": lambda words: listed(list(words)),
        "form": lambda hypothesis: form_in_words(diagnosis, hypothesis),
        "closed": lambda cause: share_text(diagnosis.share_closed(cause)),
        "words": lambda label: in_words(diagnosis, label),
        "inclusion": lambda name: probability_text(diagnosis.ranking.inclusion[name]),
        "plain": lambda name: name.replace("_", " "),
    }
    template = environment.get_template("gap/report/verdict.jinja")
    said: Any = template.make_module(_context(diagnosis))
    doubts = tuple(line for line in map(_one_line, str(said.doubts).splitlines()) if line)
    status = "bad" if diagnosis.conclusion.verdict == UNKNOWN else "doubt" if doubts else "good"
    what, where, hidden = (_one_line(text) for text in (said.what, said.where, said.hidden))
    return Words(status=status, what=what, doubts=doubts, where=where, hidden=hidden)


def _one_line(text: object) -> str:
    return " ".join(str(text).split())


def _context(diagnosis: Diagnosis) -> dict[str, Any]:
    """What the template's words depend on."""
    ranking, conclusion = diagnosis.ranking, diagnosis.conclusion
    rivals = conclusion.ambiguity_set
    labels = [cause.hypothesis.titles for cause in rivals]
    common = [label for label in labels[:1] for label in label if all(label in each for each in labels)]
    rests = [" + ".join(label for label in each if label not in common) for each in labels]
    causes = {cause.hypothesis.title: cause.probability for cause in conclusion.causes}
    possible = {**causes, "something outside the catalogue": ranking.unknown}
    gap = diagnosis.reduction.gaps[RECALIBRATED].overall
    noise = max(*diagnosis.reduction.noise_ratios.values(), 1.0)
    return {
        "d": diagnosis,
        "left": diagnosis.reduction.left.overall.value,
        "far": FAR_ABOVE_NOISE,
        "noise_level": FLOOR + LEAST_GAP_CLOSED,
        # Far above the noise as it was stated: no word may reassure.
        "far_above_noise": gap.value * noise > FAR_ABOVE_NOISE,
        "as_assumed": AS_ASSUMED,
        "common": common,
        "rests": rests,
        "all_named": all(rests),
        "possible": max(possible.items(), key=lambda pair: pair[1]),
        "disturbances": disturbances(diagnosis) if conclusion.verdict == NO_GAP else [],
        "remainder": remainder(diagnosis),
        "share_left": share_left(diagnosis),
        "place": place(remainder(diagnosis)),
        "at_bounds": parameters_at_bounds(diagnosis),
        "absorbed": [c for c in ranking.separability.absorbed if c not in diagnosis.as_consumption],
        "onsets": diagnosis.onsets_of(diagnosis.best) if diagnosis.best else {},
        "sizes": lambda cause: sizes_text(diagnosis, cause),
        "equations": lambda component: equations_of(diagnosis.localisation, component),
    }


def equations_of(localisation: Localisation, component: str) -> list[StateEquation]:
    """Equations and readings of a component, the likeliest to lack something first."""
    equations = [f.equation for f in localisation.forcings if f.equation.component == component]
    return sorted(equations, key=lambda each: -localisation.equation_probabilities[each.name])


def place(left: Localisation | None) -> tuple[StateEquation, float] | None:
    """Where the remainder lies, and how probable that is; None where the recordings do not show it."""
    if not left or not left.forcings:
        return None
    equation = left.likeliest.equation
    probability = left.equation_probabilities[equation.name]
    return (equation, probability) if probability > left.nothing_missing else None


def disturbances(diagnosis: Diagnosis) -> list[str]:
    """Disturbances that are seen beside the noise, of each channel that has one."""
    ranking, seen = diagnosis.ranking, discrepancy(diagnosis)
    return [
        f"{quantity(seen[channel.name]['sd'], channel.unit)} in {channel.name}, correlated over "
        f"{quantity(seen[channel.name]['time_scale_s'], 's')}"
        for channel, noise in zip(ranking.problem.plant.channels, ranking.noise, strict=True)
        if noise.sd >= MENTIONED_DISCREPANCY
    ]


def look_alikes(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """Causes that the recordings hardly tell from one cause, with the signatures' correlation."""
    separability = diagnosis.ranking.separability
    index = separability.labels.index
    twins = [
        f"{in_words(diagnosis, twin)} ({abs(separability.correlation[index(label), index(twin)]):.3f})"
        for label in cause.hypothesis.labels
        for twin in separability.twins(label)
    ]
    return ", ".join(twins) or "-"


def parameters_at_bounds(diagnosis: Diagnosis) -> list[str]:
    """Fitted parameters at an end of their physical range, of the model to use and of named causes.

    A cause's parameter that stays at its nominal value adds nothing, so its end tells nothing.
    """
    problem = diagnosis.ranking.problem
    named = {cause.hypothesis.label: cause.hypothesis for cause in diagnosis.conclusion.ambiguity_set}
    models = {diagnosis.model_label: diagnosis.model} | named
    estimates = {name: hypothesis.estimate for name, hypothesis in models.items()}
    ends = [
        f"{name}: {p.title} is at an end of its physical range ({quantity(value, p.unit)})"
        for name, estimate in estimates.items()
        for p in (*problem.plant.parameters, *estimate.hypothesis.cause_parameters)
        for value in [problem.values(estimate)[p.symbol]]
        if at_an_end(p, value)
        and not (p in estimate.hypothesis.cause_parameters and _meet(p, value, p.nominal))
    ]
    return ends + [
        f"{name}: its strength may follow {law.argument} even more than the fit allows"
        for name, estimate in estimates.items()
        for law, components in estimate.laws
        if any(at_an_end(p, z) for p, z in zip(law.parameters, components, strict=True))
    ]


def at_an_end(parameter: FreeParameter, value: float) -> bool:
    """Whether a value [SI] lies at an end of its parameter's physical range."""
    return _meet(parameter, value, parameter.low) or _meet(parameter, value, parameter.high)


def _meet(parameter: FreeParameter, value: float, other: float) -> bool:
    return abs(value - other) <= BOUND_TOLERANCE * abs(parameter.high - parameter.low)


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


PREFIXES = {"M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}

POWER_PREFIXES = {"": 1.0, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6}
"""Prefixes of units, and of units with a power of two or three."""

PREFIXED = (
    "A", "C", "F", "H", "Hz", "J", "K", "N", "Ohm", "Pa", "S", "T", "V", "W", "bar", "g", "m", "rad",
    "s",
)  # fmt: skip
"""Units that take a prefix."""


def quantity(value: float, unit: str) -> str:
    """A value [SI] with its unit and a prefix: 2.4 mS, 0.02 mm^2."""
    name, scale = readable_unit(unit, value)
    return f"{three_digits(value / scale)} {name}".strip()


def quantity_with_interval(value: float, low: float, high: float, unit: str) -> str:
    """A value [SI] and the ends of its interval [SI], with one unit."""
    name, scale = readable_unit(unit, value)
    numbers = [three_digits(number / scale) for number in (value, low, high)]
    return f"{numbers[0]} ({numbers[1]} to {numbers[2]}) {name}".strip()


def three_digits(number: float) -> str:
    """A number to three significant digits, without an exponent where none is needed."""
    if 1e-3 <= abs(number) < 999.5:
        return f"{number:#.3g}".rstrip(".")
    return f"{number:.0f}" if 999.5 <= abs(number) < 1e6 else f"{number:.3g}"


def readable_unit(unit: str, size: float) -> tuple[str, float]:
    """The unit with the prefix that suits numbers of a size [SI], and the size of that unit in SI.

    A unit that takes no prefix stays as it is, as does one with another power; '1' is no unit.
    """
    if unit == "1":
        return "", 1.0
    first = re.match(r"([A-Za-z]+)(?:\^([23]))?(?=$|[\s/·*.])(?!\.\d)", plain_powers(unit))
    if not first or first[1] not in PREFIXED:
        return unit, 1.0
    power = int(first[2] or 1)
    least, prefixes = (1.0, PREFIXES) if power == 1 else (1e-2, POWER_PREFIXES)
    for prefix, factor in prefixes.items():
        if abs(size) >= least * factor**power:
            return prefix + unit, factor**power
    return unit, 1.0


def listed(words: Sequence[str]) -> str:
    """Words in a sentence: a, b and c."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else "".join(words)


def probability_text(probability: float) -> str:
    """A probability in percent, bounded by < 1 % and > 99 %."""
    if probability > 0.99:
        return "> 99 %"
    return "< 1 %" if probability < 0.01 else f"{100 * probability:.0f} %"


def share_text(share: Interval) -> str:
    """A share [1] and its interval in percent."""
    return f"{100 * share.value:.0f} % ({100 * share.low:.0f} to {100 * share.high:.0f} %)"


def gap_text(value: float) -> str:
    """A gap [noise deviations], to the hundredth below ten."""
    return f"{value:.2f}" if value < 9.995 else f"{value:.1f}"


def gap_with_interval(gap: Interval) -> str:
    """A gap and its interval [noise deviations]."""
    return f"{gap_text(gap.value)} ({gap_text(gap.low)} to {gap_text(gap.high)})"
