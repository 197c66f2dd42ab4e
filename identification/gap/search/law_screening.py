"""Over which states the law of a cause should be open, by linear prediction.

The law of a cause is opened over every state of the plant, at the cause's trial size where it has ended
at nearly nothing: with the wrong law a fit may send the true cause there. One step of least squares then
says what each law promises.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from epv_env.common.law_form import MOST_LAWS
from identification.gap.fit.fitting_problem import Estimate, FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.laws import COMPONENTS, LARGEST, MOST_OF_CAUSE, Law
from identification.gap.fit.recalibration import restarted
from identification.gap.fit.variable_projection import LinearisedRun, equations_of, products_of
from identification.gap.plant import Cause
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.search.screening import Start

TOGETHER = 4
"""Causes whose laws are linearised together, for memory."""


def law_starts(
    problem: FittingProblem,
    base: Estimate,
    estimates: Sequence[Estimate],
    causes: Sequence[Cause],
    runs: Sequence[int],
) -> list[Start]:
    """Starts with one more open law, by the chi-square that they promise, the least first.

    Args:
        problem: the plant with its readings.
        base: whose states, which change, the laws may follow.
        estimates: from which the law is opened.
        causes: whose law, by estimate; the estimate has the cause.
        runs: indices of the runs that count.
    """
    if not getattr(problem.plant, "law_arguments", ()):
        return []
    ranges = {name: ends for name, ends in _ranges(problem, base, runs).items() if ends[0] < ends[1]}
    pairs = [
        (at_least_trial_size(problem, estimate, cause), cause)
        for estimate, cause in zip(estimates, causes, strict=True)
        if not cause.exact_form and _may_have_another(estimate.hypothesis, cause)
    ]
    starts: list[Start] = []
    for first in range(0, len(pairs), TOGETHER):
        part = pairs[first : first + TOGETHER]
        opened = [_with_every_law(problem, estimate, cause, ranges) for estimate, cause in part]
        linearised = linearise(problem, opened, runs)
        for (estimate, _), whole, own in zip(part, opened, linearised, strict=True):
            starts += _starts(problem, estimate, whole, own)
    return sorted(starts, key=lambda start: start.chi_square)


def _may_have_another(hypothesis: Hypothesis, cause: Cause) -> bool:
    """Whether one more law of a cause may be opened."""
    own = sum(law.cause.label == cause.label for law in hypothesis.laws)
    return len(hypothesis.laws) < MOST_LAWS and own < MOST_OF_CAUSE


def _starts(
    problem: FittingProblem, estimate: Estimate, whole: Estimate, runs: Sequence[LinearisedRun]
) -> Iterator[Start]:
    """Starts with each of the laws that `whole` has beyond `estimate`. runs: `whole`, linearised."""
    products, known = products_of(runs), len(estimate.hypothesis.laws)
    low, high = problem.ends(whole)
    opened = whole.hypothesis.laws[known:]
    behind = np.arange(len(whole.vector) - len(whole.hypothesis.cause_parameters), len(whole.vector))
    first = behind[0] - sum(len(law.parameters) for law in opened)
    shared = np.arange(1 + len(whole.vector), products.count)
    place = first
    for law in opened:
        components = np.arange(place, place + len(law.parameters))
        place += len(law.parameters)
        places = np.concatenate([np.arange(first), components, behind])
        columns = np.concatenate([[0], 1 + places, shared])
        equations = equations_of(products.of(columns), len(places))
        step, decrease = equations.step(low[places], high[places], damping=1e-3)  # nearly none
        hypothesis = replace(estimate.hypothesis, laws=(*estimate.hypothesis.laws, law))
        yield Start(
            estimate=replace(estimate, hypothesis=hypothesis, vector=whole.vector[places] + step),
            chi_square=equations.chi_square - decrease,
        )


def at_least_trial_size(problem: FittingProblem, estimate: Estimate, cause: Cause) -> Estimate:
    """The estimate as a start, with a cause at its first trial where its size is nearly nothing."""
    values = problem.values(estimate)
    sizes = [abs((values[p.symbol] - p.nominal) / (p.trials[0] - p.nominal)) for p in cause.sizes]
    if max(sizes) >= 0.3:
        return restarted(estimate)
    trial = {p.symbol: p.trials[0] for p in cause.sizes}
    begun = problem.start(estimate.hypothesis, {**values, **trial})
    return replace(restarted(estimate), vector=begun.vector)


def _with_every_law(
    problem: FittingProblem, estimate: Estimate, cause: Cause, ranges: Mapping[str, tuple[float, float]]
) -> Estimate:
    """The estimate with the law of a cause open over every state; all as assumed yet.

    ranges: least and greatest value of the states, by name [SI].
    """
    known = estimate.hypothesis.laws
    taken = {law.argument for law in known if law.cause.label == cause.label}
    laws = [
        Law(cause=cause, argument=argument, low=low, high=high)
        for argument, (low, high) in ranges.items()
        if argument not in taken
    ]
    hypothesis = replace(estimate.hypothesis, laws=(*known, *laws))
    begun = problem.start(hypothesis, problem.values(estimate))
    return replace(estimate, hypothesis=hypothesis, vector=begun.vector)


def _ranges(
    problem: FittingProblem, estimate: Estimate, runs: Sequence[int]
) -> dict[str, tuple[float, float]]:
    """Least and greatest value of every state that a law may follow, by name [SI]."""
    plant = prepared(problem.plant)
    traces = [plant.law_states(problem.candidate(estimate), r) for r in runs]
    return {
        argument: (
            float(min(np.min(trace[argument].values) for trace in traces)),
            float(max(np.max(trace[argument].values) for trace in traces)),
        )
        for argument in plant.law_arguments
    }


def over_reached_states(problem: FittingProblem, estimate: Estimate) -> Estimate:
    """The estimate as a start, with the knots of its laws between the states that it reaches itself.

    The start of the fit may have moved much further, or less. What has no room in the prior is lost.
    """
    if not estimate.laws:
        return restarted(estimate)
    ranges = _ranges(problem, estimate, problem.fitted_runs)
    values, laws = problem.values(estimate), []
    for law, components in estimate.laws:
        low, high = ranges[law.argument]
        moved = replace(law, low=low, high=high) if low < high else law
        growth = np.interp(moved.knots, law.knots, law.growth(components))
        mean = float(np.mean(growth))
        factor = max(1.0 + mean, 0.1)  # on the size, which stands for the mean of the law
        parts = np.linalg.lstsq(COMPONENTS, (growth - mean) / factor, rcond=None)[0]
        parts = np.clip(parts, -LARGEST, LARGEST)
        values |= dict(zip((p.symbol for p in law.parameters), parts, strict=True))
        sizes = law.cause.sizes
        values |= {p.symbol: p.nominal + (values[p.symbol] - p.nominal) * factor for p in sizes}
        laws.append(moved)
    hypothesis = replace(estimate.hypothesis, laws=tuple(laws))
    begun = problem.start(hypothesis, values)
    return replace(restarted(estimate), hypothesis=hypothesis, vector=begun.vector)
