"""Form modes: directions in which the law of a cause may differ from the one that is assumed.

A cause adds a contribution e(t) to the equations and readings of the nominal model. Its law may be
wrong: e may grow otherwise with its own size, act late, or act more in one equation than in another.
Each is a mode, e(t) phi(t) or -tau de/dt, whose share is a nuisance with a Gaussian prior. The response
of the outputs is linearised. A cause whose contribution the plant cannot tell has the modes of its
change of the outputs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fitting_problem import (
    Estimate,
    FittingProblem,
    FormSlopes,
    cause_places,
    cause_sizes,
    nominal_vector,
)
from identification.gap.plant import Cause, Contribution, GreyBox, noise_weighted

FORM_SD = 1.0 / 3.0
"""Standard deviation of a mode's share of the cause [1]: laws of one mechanism differ by about a third,
as a linear loss does from a quadratic one over a usual range."""

MODE_STEP = 0.1
"""Part of a mode's standard deviation that is simulated [1]: small enough to be linear."""

OWN_SIZE, LATE = "its own size", "delay"
"""Modes that every cause has. Others are named by an equation or a channel in which the cause acts,
where it acts in several."""

LARGEST_SIZE = 3.0
"""Bound of the standardised size in the mode of that name [standard deviations]."""

LEAST_VARIATION = 1e-6
"""Relative variation of a term's magnitude [1] below which it is constant but for rounding."""

USED = 0.05
"""Part of the cause from which a mode is mentioned [1]."""

AS_ASSUMED = "as assumed"
"""What is said of a cause none of whose modes is mentioned (contract: gap.json)."""

Terms = Mapping[str, NDArray]
"""Forcings by equation, and changes of readings by channel, (samples,) [SI]."""


@dataclass(frozen=True, kw_only=True)
class Law:
    """What a cause adds to one equation or reading, over all runs, (values,) each [SI]."""

    cause: str
    """The cause for people."""
    term: str
    """Name of the equation or channel."""
    assumed: NDArray
    """By the law of the catalogue."""
    wanted: NDArray
    """By the law that the recordings want: with the modes' shares."""


def form_modes(problem: FittingProblem, estimate: Estimate) -> FormSlopes | None:
    """The outputs' derivatives by the modes of an estimate's causes; None without modes."""
    plant, modes, owners = problem.plant, [], []
    blocks: list[list[NDArray]] = [[] for _ in plant.runs]
    for number, (_, _, names, each) in enumerate(_modes_of_causes(problem, estimate)):
        modes += names
        owners += [number] * len(names)
        for r, terms in enumerate(each if names else ()):
            response = _response(plant, problem.candidate(estimate), r, terms)
            blocks[r].append(np.nan_to_num(noise_weighted(plant, r, response)))
    if not modes:
        return None
    slopes = [np.concatenate(own, axis=-1).reshape(-1, len(modes)) for own in blocks]
    places = np.array(owners)
    sizes = cause_sizes(estimate)[0][places]
    return FormSlopes(names=modes, slopes=slopes, owners=places, sizes=sizes)


def laws(problem: FittingProblem, estimate: Estimate) -> list[Law]:
    """The law of each cause with modes, as assumed and as the recordings want it."""
    found, shares = [], estimate.shares
    if shares is None or not len(shares):
        return []
    for cause, courses, names, each in _modes_of_causes(problem, estimate):
        own, shares = shares[: len(names)], shares[len(names) :]
        for term in courses[0]:
            assumed = np.concatenate([course[term] for course in courses])
            change = np.concatenate([modes[term] for modes in each]) @ own
            found.append(Law(cause=cause.title, term=term, assumed=assumed, wanted=assumed + change))
    return found


def _modes_of_causes(
    problem: FittingProblem, estimate: Estimate
) -> Iterator[tuple[Cause, list[Terms], list[str], list[dict[str, NDArray]]]]:
    """Each cause, what it adds in each run, and names and terms of its modes; none for an exact form."""
    periods = [float(run.time[1] - run.time[0]) for run in problem.plant.runs]
    for cause, _, _ in cause_places(estimate):
        courses = [] if cause.exact_form else _contributions(problem, estimate, cause)
        if not courses or not courses[0]:
            yield cause, [{}], [], []
        else:
            yield cause, courses, *_modulated(courses, periods)


def _contributions(problem: FittingProblem, estimate: Estimate, cause: Cause) -> list[Terms]:
    """What the cause adds in each run."""
    plant, values = problem.plant, problem.candidate(estimate)
    symbols = [own.symbol for own in (*cause.parameters, *cause.run_parameters)]
    found = [plant.contribution(values, symbols, r) for r in range(len(plant.runs))]
    if not any(own and _acts(own) for own in found):
        changes = _changes(problem, estimate, cause)
        found = [Contribution(equations={}, readings=change) for change in changes]
    channels = [channel.name for channel in plant.channels]
    terms = [{**o.equations, **dict(zip(channels, o.readings, strict=True))} if o else {} for o in found]
    acting = [term for term in terms[0] if any(np.any(own[term]) for own in terms)]
    return [{term: np.nan_to_num(own[term]) for term in acting} for own in terms]


def _acts(own: Contribution) -> bool:
    return any(np.any(terms) for terms in (*own.equations.values(), own.readings))


def _changes(problem: FittingProblem, estimate: Estimate, cause: Cause) -> list[NDArray]:
    """Change of the outputs by a cause, per run (channels, samples) [SI]."""
    place = next(place for own, place, _ in cause_places(estimate) if own is cause)
    vector = estimate.vector.copy()
    vector[place] = nominal_vector(cause)
    both = problem.candidates([estimate, replace(estimate, vector=vector)])
    outputs = problem.plant.outputs(both, problem.all_runs)
    return [np.nan_to_num(y[..., 0] - y[..., 1]) for y in outputs]


def _modulated(
    courses: Sequence[Terms], periods: Sequence[float]
) -> tuple[list[str], list[dict[str, NDArray]]]:
    """Names of the modes, and per run the terms of each at its standard deviation (samples, modes)."""
    several = list(courses[0]) if len(courses[0]) > 1 else []
    names = [OWN_SIZE, LATE, *several]
    found: list[dict[str, NDArray]] = [{} for _ in courses]
    for term in courses[0]:
        every = [course[term] for course in courses]
        sizes = _standard_sizes(every)
        rates = [np.gradient(e, period) for e, period in zip(every, periods, strict=True)]
        whole = _mean_square(every)
        time = np.sqrt(whole / max(_mean_square(rates), np.finfo(float).tiny * whole))  # finite: rates 0
        for own, e, size, rate in zip(found, every, sizes, rates, strict=True):
            alone = [e if term == name else np.zeros_like(e) for name in several]
            own[term] = FORM_SD * np.stack([size * e, -time * rate, *alone], axis=1)
    return names, found


def _standard_sizes(every: Sequence[NDArray]) -> list[NDArray]:
    """Magnitude of a term in each run, less its mean where the term acts, in standard deviations."""
    whole = np.abs(np.concatenate(every))
    weights = whole**2 / np.sum(whole**2)
    mean = float(weights @ whole)
    sd = float(np.sqrt(weights @ (whole - mean) ** 2))
    if sd <= LEAST_VARIATION * mean:
        return [np.zeros_like(e) for e in every]
    return [np.clip((np.abs(e) - mean) / sd, -LARGEST_SIZE, LARGEST_SIZE) for e in every]


def _mean_square(series: Sequence[NDArray]) -> float:
    return float(np.mean(np.concatenate(series) ** 2))


def _response(
    plant: GreyBox, values: Mapping[str, NDArray], run: int, terms: Mapping[str, NDArray]
) -> NDArray:
    """Change of the outputs by each mode, (channels, samples, modes) [SI]; terms: (samples, modes)."""
    channels = [channel.name for channel in plant.channels]
    first = next(iter(terms.values()))
    change = np.zeros((len(channels), *first.shape))
    for c, name in enumerate(channels):
        if name in terms:
            change[c] += terms[name]
    forcing = {term: MODE_STEP * own for term, own in terms.items() if term not in channels}
    return change + plant.forced(values, run, forcing) / MODE_STEP if forcing else change


def law_in_words(estimate: Estimate, plant: GreyBox | None = None) -> str:
    """How the law that the recordings want differs from the one assumed, mode by mode.

    plant: says the equations in words; without it they are names, as in files.
    """
    titles = {equation.name: equation.title for equation in plant.equations} if plant else {}
    forms = estimate.slopes.forms if estimate.slopes else None
    if forms is None or estimate.shares is None:
        return AS_ASSUMED
    used = [
        f"{_words(titles.get(name, name), share < 0)} ({abs(share) * FORM_SD:.0%})"
        for name, share in zip(forms.names, estimate.shares, strict=True)
        if abs(share) * FORM_SD >= USED
    ]
    return ", ".join(used) or AS_ASSUMED


def _words(name: str, negative: bool) -> str:
    if name == OWN_SIZE:
        return "grows slower with its size" if negative else "grows faster with its size"
    if name == LATE:
        return "acts earlier" if negative else "acts later"
    return f"acts less in {name}" if negative else f"acts more in {name}"
