"""What has no name, learnt: a term that the truth has and the model lacks is found again."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from epv_env.plant.effects.learnt import KNOT_SYMBOLS, LearntTerm
from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE
from identification.bench.session import measured_campaign, run_programme
from identification.block_bootstrap import Interval
from identification.gap.evidence import evaluate
from identification.gap.recalibration import recalibrate
from identification.valve_gap.learnt_term import (
    LearntModel,
    WithTerm,
    covariance_of,
    find_places,
    fit_term,
    term_of,
)
from identification.valve_gap.valve import Valve

TRUTH = LearntTerm(
    equation="f1", unit="g/s", state="p1 - p2", state_unit="Pa", low=0.0, high=8e5,
    values=(0.0, 0.15, 0.25, 0.2, 0.1, -0.05, -0.1, -0.1, -0.1), sd=(0.02,) * 9,
    share_closed=(0.9, 0.8, 1.0),
)  # fmt: skip
CALIBRATED = Parameters.calibrated()
NAMES = ("test1", "low_supply", "rest", "validation")


@pytest.fixture(scope="module")
def fitted():
    """Where the term is found, and the term fitted there."""
    truth = CALIBRATED.replace(**TRUTH.parameters)
    programmes = [run_programme(truth, p) for p in DIAGNOSIS_SUITE if p.name in NAMES]
    valve = Valve(measured_campaign(programmes, truth, seed=7301))
    problem, base = recalibrate(valve)
    base = replace(base, slopes=problem.slopes)
    evaluated = evaluate(problem, [base])[0]
    place = find_places(problem, base, evaluated.residuals)[0]
    start = np.concatenate([evaluated.tolerances, np.zeros(9)])
    best = fit_term(WithTerm(problem.plant, valve, place), base, start)
    return best, term_of(best, covariance_of(best), Interval(value=0.9, low=0.8, high=1.0))


def test_the_equation_that_lacks_a_term_is_found(fitted):
    assert fitted[0].place.equation == TRUTH.equation


def test_the_fitted_term_is_the_true_one_where_recordings_tell_of_it(fitted):
    best, term = fitted
    assert best.misfit < 1.05 * best.problem.readings
    assert term.state == TRUTH.state
    at = np.linspace(term.low, term.high, len(term.values))
    true = np.interp(at, np.linspace(TRUTH.low, TRUTH.high, 9), TRUTH.values)
    told = np.array(term.sd) < 0.03
    assert np.sum(told) >= 4
    assert np.all(np.abs(np.array(term.values) - true)[told] < 0.05)


def test_its_uncertainty_is_drawn_with_the_plant(fitted):
    """Draws scatter as the covariance says, and the plant that made the recordings is one of them."""
    best, term = fitted
    covariance = covariance_of(best)
    symbols = (*(p.symbol for p in best.problem.parameters(best.estimate)), *KNOT_SYMBOLS)
    values = {**best.problem.values(best.estimate), **term.parameters}
    closed = Interval(value=0.9, low=0.8, high=1.0)
    model = LearntModel(
        term=term, parameters=values, symbols=symbols, covariance=covariance, gap=closed, closed=closed,
    )  # fmt: skip
    region = model.region(CALIBRATED, 0.95)
    rng = np.random.default_rng(0)
    drawn = np.array([[region.draw(rng)[s] for s in symbols] for _ in range(2000)])
    sd = np.sqrt(np.diag(covariance) * region.chi_square / (len(symbols) + 2))  # uniform in a ball
    np.testing.assert_allclose(np.std(drawn, axis=0), sd, rtol=0.15)
    calibrated = len(symbols) - len(KNOT_SYMBOLS)
    off = [values[s] - CALIBRATED[s] for s in symbols[:calibrated]]
    own = covariance[:calibrated, :calibrated]
    assert off @ np.linalg.solve(own, off) < chi2.ppf(0.99, calibrated)
