"""Probabilities under noise and discrepancy: for noise none, whatever its stated size."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identification.gap.diagnosis import rank_hypotheses
from identification.gap.evidence import EvaluatedHypothesis
from identification.gap.posterior import (
    FIGURES,
    UNKNOWN_SHARE,
    Posterior,
    misfit_beyond_noise,
    posterior,
)
from identification.gap.verdict import Ranking
from tests.identification.gap.drives import Drive


@cache
def _ranked(truth: tuple[tuple[str, float], ...], seed: int) -> Ranking:
    return rank_hypotheses(Drive(dict(truth), seed=seed))


def ranked(truth: dict[str, float], seed: int = 0) -> Ranking:
    return _ranked(tuple(truth.items()), seed)


def weighed(found: Ranking, change=lambda each: each) -> Posterior:
    """Probabilities of the same fits, each changed."""
    every = [change(each) for each in (found.recalibrated, *found.hypotheses)]
    return posterior(found.problem, every[0], every[1:])


def in_units_of(factor: float, each: EvaluatedHypothesis) -> EvaluatedHypothesis:
    """A hypothesis where the channels' noise is stated `factor` times as large."""
    return replace(
        each,
        residuals=[residual / factor for residual in each.residuals],
        squares=each.squares / factor**2,
        covariance=each.covariance * factor**2,
    )


def everything(found: Posterior) -> list[float]:
    return [found.no_cause, found.unknown, *found.probabilities]


TRUTHS = [{}, {"coupling": 0.1}, {"dead_zone": 0.15, "lag": 0.03, "coupling": 0.1}]


@pytest.mark.parametrize(("truth", "factor"), [(TRUTHS[0], 0.3), (TRUTHS[2], 3.0)])
def test_the_scale_of_the_noise_does_not_matter(truth, factor):
    """But for nuisance parameters, whose deviations do not scale and hardly count here."""
    found = ranked(truth)
    scaled = weighed(found, lambda each: in_units_of(factor, replace(each, nuisance_penalty=0.0)))
    plain = weighed(found, lambda each: replace(each, nuisance_penalty=0.0))
    assert everything(scaled) == pytest.approx(everything(plain), abs=0.02)


@pytest.mark.parametrize("truth", TRUTHS)
def test_probabilities_sum_to_one(truth):
    found = weighed(ranked(truth))
    assert sum(everything(found)) == pytest.approx(1.0)
    assert min(everything(found)) >= 0.0


@pytest.mark.parametrize("seed", range(6))
def test_for_noise_no_cause_is_named(seed):
    found = ranked({}, seed)
    assert found.no_cause > 0.9
    assert max(found.inclusion.values()) < 0.1


@pytest.mark.parametrize(("seed", "size"), [(0, 0.5), (1, 2.0), (2, 8.0)])
def test_the_more_a_cause_explains_the_less_no_cause_is_believed(seed, size):
    """Sizes in noise deviations: within noise none is named, far beyond it the cause is certain."""
    found = ranked({"coupling": size * 0.001}, seed)
    larger = ranked({"coupling": 4 * size * 0.001}, seed)
    assert larger.no_cause <= found.no_cause + 1e-3


def test_a_cause_at_the_end_of_its_range_is_not_named():
    found = ranked({"coupling": 0.1})
    ended = weighed(found, lambda each: replace(each, at_bound="coupling" in each.labels))
    for each, probability in zip(found.hypotheses, ended.probabilities, strict=True):
        if "coupling" in each.labels:
            assert probability == 0.0
    assert sum(everything(ended)) == pytest.approx(1.0)


def test_a_cause_that_removes_more_has_less_misfit_and_share():
    found = ranked({"dead_zone": 0.15, "lag": 0.03, "coupling": 0.1})
    shares = {frozenset(e.labels): s for e, s in zip(found.hypotheses, found.shares_left, strict=True)}
    assert shares[frozenset({"dead_zone", "lag", "coupling"})] < 1e-6
    assert shares[frozenset({"lag", "coupling"})] > 0.05
    misfits = [misfit_beyond_noise(each, found.discrepancies) for each in found.hypotheses]
    order = np.argsort(misfits)
    assert np.all(np.diff(np.array(found.shares_left)[order]) >= 0.0)


def test_a_small_second_cause_beside_a_large_one_is_named():
    """Its effect is far beyond what another law of the large one would leave."""
    found = rank_hypotheses(Drive({"coupling": 0.3, "dead_zone": 0.06}))
    assert found.inclusion["dead_zone"] > 0.9


def test_figures_say_what_a_hypothesis_leaves_and_costs():
    found = ranked({"coupling": 0.1})
    figures = dict(zip(FIGURES, found.figures.T, strict=True))
    assert figures["fit"][-2] == pytest.approx(0.0, abs=0.05)  # no cause leaves all
    assert figures["fit"][-1] == pytest.approx(-np.log(UNKNOWN_SHARE), abs=0.05)
    assert list(figures["causes"][:-2]) == [len(each.labels) for each in found.hypotheses]
    assert list(figures["no_cause"]) == [0.0] * len(found.hypotheses) + [1.0, 0.0]
