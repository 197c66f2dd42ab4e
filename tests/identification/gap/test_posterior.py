"""Probabilities from what hypotheses leave beyond noise: for noise none, whatever its stated size."""

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identification.gap.diagnosis import rank_hypotheses
from identification.gap.fit.fitting_problem import Hypothesis
from identification.gap.fit.laws import Law
from identification.gap.judge.verdict import Ranking
from identification.gap.search.posterior import (
    POWER,
    UNKNOWN,
    UNKNOWN_SHARE,
    Posterior,
    log_priors,
    misfit_beyond_noise,
    posterior,
    tolerated_misfit,
)
from tests.identification.gap.drives import RANGES, Drive


@cache
def _ranked(truth: tuple[tuple[str, float], ...], seed: int) -> Ranking:
    return rank_hypotheses(Drive(dict(truth), seed=seed))


def ranked(truth: dict[str, float], seed: int = 0) -> Ranking:
    return _ranked(tuple(truth.items()), seed)


def weighed(found: Ranking, change=lambda each: each) -> Posterior:
    """Probabilities of the same fits, each changed."""
    first, *others = (change(each) for each in (found.recalibrated, *found.hypotheses))
    return posterior(found.problem, first, others)


def odds(found: Posterior) -> dict[tuple[str, ...], float]:
    """Probability of each hypothesis relative to that of no cause."""
    pairs = zip(found.hypotheses, found.probabilities, strict=True)
    return {each.labels: probability / found.no_cause for each, probability in pairs}


@pytest.mark.parametrize("seed", range(6))
def test_for_noise_no_cause_is_named(seed):
    found = ranked({}, seed)
    assert found.no_cause > 0.9
    assert max(found.inclusion.values()) < 0.1


def test_a_cause_at_the_end_of_its_range_is_e_times_less_probable():
    found = ranked({"coupling": 0.1})
    before = odds(weighed(found))
    ended = odds(weighed(found, lambda each: replace(each, unusual="coupling" in each.labels)))
    for labels, share in before.items():
        expected = share / np.e if "coupling" in labels else share
        assert ended[labels] == pytest.approx(expected, rel=1e-9)


def test_a_probability_is_a_power_of_what_is_left_times_its_prior():
    found = ranked({"coupling": 0.1})
    tolerated = tolerated_misfit(sum(own.readings for own in found.noise))
    whole = misfit_beyond_noise(found.recalibrated, found.noise)
    none, *priors = np.exp(log_priors(found.problem, found.hypotheses))
    for each, prior in zip(found.hypotheses, priors, strict=True):
        left = max(misfit_beyond_noise(each, found.noise), 0.0)
        expected = ((tolerated + left) / (tolerated + whole)) ** -POWER * prior / none
        assert odds(found)[each.labels] == pytest.approx(expected, rel=1e-6)


def test_an_unknown_cause_is_as_complex_as_the_best_and_leaves_a_share():
    found = ranked({"coupling": 0.1})
    tolerated = tolerated_misfit(sum(own.readings for own in found.noise))
    whole = misfit_beyond_noise(found.recalibrated, found.noise)
    left = max(misfit_beyond_noise(found.hypotheses[0], found.noise), 0.0)
    share = (tolerated + UNKNOWN_SHARE * whole) / (tolerated + left)
    assert found.unknown / found.probabilities[0] == pytest.approx(UNKNOWN * share**-POWER, rel=1e-6)


def test_sets_of_as_many_causes_share_a_prior_and_an_open_law_costs_its_choice():
    found = ranked({"dead_zone": 0.15, "lag": 0.03, "coupling": 0.1})
    one, count = next(each for each in found.hypotheses if len(each.labels) == 1), len(RANGES)
    causes = tuple(found.problem.plant.causes)
    sets = {
        number: replace(
            one, estimate=replace(one.estimate, hypothesis=Hypothesis(causes=causes[:number]))
        )
        for number in (1, 2, 3)
    }
    problem = copy(found.problem)
    none, *own = np.exp(log_priors(problem, list(sets.values())))
    each_size = problem.readings**-0.5
    shared = {1: 0.3 / count, 2: 0.03 / (count * (count - 1) / 2), 3: 0.003 / 20}
    shared = {number: prior * each_size**number for number, prior in shared.items()}
    assert none == pytest.approx(0.5)
    given = dict(zip(sets, own, strict=True))
    assert {number: given[number] for number in shared} == pytest.approx(shared)
    problem.plant.law_arguments = ("u", "w")  # type: ignore[attr-defined]
    single = sets[1].estimate
    law = Law(cause=single.hypothesis.causes[0], argument="u", low=0.0, high=1.0)
    lawful = replace(single, hypothesis=replace(single.hypothesis, laws=(law,)))
    opened = replace(sets[1], estimate=lawful, law_penalty=0.7)
    found_prior = np.exp(log_priors(problem, [opened])[1])
    assert found_prior == pytest.approx(shared[1] * np.exp(-0.7) / 2.0)
