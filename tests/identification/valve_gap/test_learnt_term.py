"""What has no name, learnt: a term that the truth has and the model lacks is found again."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.effects.learnt import KNOT_SYMBOLS, LearntTerm
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import Region
from identification.bench.programmes import DIAGNOSIS_SUITE
from identification.bench.session import measured_campaign, run_programme
from identification.block_bootstrap import Interval
from identification.gap.evidence import evaluate
from identification.gap.recalibration import recalibrate
from identification.valve_gap.learnt_term import LearntModel, WithTerm, find_places, fit_term, term_of
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
    return best, term_of(best, Interval(value=0.9, low=0.8, high=1.0))


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


def test_its_uncertainty_is_drawn_with_the_plant():
    model = LearntModel(
        term=TRUTH, parameters={"R": 41.0, **TRUTH.parameters},
        gap=Interval(value=1.0, low=1.0, high=1.1), closed=Interval(value=0.9, low=0.8, high=1.0),
    )  # fmt: skip
    region = model.region(Region(centre=CALIBRATED))
    drawn = np.array(
        [[region.draw(rng)[s] for s in KNOT_SYMBOLS] for rng in map(np.random.default_rng, range(300))]
    )
    np.testing.assert_allclose(np.mean(drawn, axis=0), TRUTH.values, atol=0.005)
    np.testing.assert_allclose(np.std(drawn, axis=0), TRUTH.sd, rtol=0.15)
