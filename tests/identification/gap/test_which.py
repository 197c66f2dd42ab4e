"""The diagnosis on a plant that is not the valve: what is wrong is found, or nothing is."""

import numpy as np
import pytest

from docs.examples.tank.plant import Tank
from docs.examples.tank.recordings import recorded
from identification.gap.fit.fit_cache import Fits
from identification.gap.fit.fitter import Fitter, Hypothesis
from identification.gap.rank.cause_pairs import doubted, with_halves
from identification.gap.rank.evidence import Assessed, assess, stretches
from identification.gap.rank.ranking import which
from identification.gap.rank.refit import recalibrated


@pytest.mark.parametrize(("name", "size"), [("leak", 4e-3), ("lag", 4.0), ("evaporation", 8e-4)])
def test_the_cause_that_made_the_recordings_is_found_with_its_size(name, size):
    found = which(Tank(recorded({"c": 0.021, name: size})))
    best = found.candidates[0]
    assert best.name == (name,)
    assert found.probability[0] > 0.7
    fitted = found.fitter.values(best.point)
    assert fitted["c"] == pytest.approx(0.021, rel=0.02)
    assert fitted[name] == pytest.approx(size, abs=4 * np.sqrt(best.covariance[-1, -1]))
    held_out = np.concatenate([best.residuals[2].ravel()])
    assert np.sqrt(np.mean(held_out**2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_without_a_cause_recalibration_is_enough(seed):
    found = which(Tank(recorded({"c": 0.021}, seed=seed)))
    assert found.no_cause > 0.5
    assert found.no_cause + found.unknown + sum(found.probability) == pytest.approx(1.0)


def test_what_the_catalogue_lacks_is_unknown():
    """An inflow that is not what was measured: no cause of the list makes steps of its own."""
    tank = Tank(recorded({"c": 0.021}))
    for run in tank.runs:
        run.measured[:] += 0.02 * np.sin(run.time / 3.0)
    found = which(tank)
    assert found.unknown > 0.9


def test_two_causes_are_found_together():
    found = which(Tank(recorded({"leak": 4e-3, "lag": 5.0})))
    assert set(found.candidates[0].name) == {"leak", "lag"}
    assert found.probability[0] > 0.9


def assessed(fitter: Fitter, **sizes: float) -> tuple[Assessed, Assessed]:
    """Causes as they stand at given sizes, and fitted from there."""
    causes = tuple(cause for cause in fitter.plant.causes if cause.name in sizes)
    start = fitter.start(Hypothesis(causes=causes), {"c": 0.021, **sizes})
    at, fitted = assess(fitter, [start, *fitter.fit([start])])
    return at, fitted


@pytest.mark.parametrize(("lag", "likelier"), [(5.0, True), (0.0, False)])
def test_no_pair_is_surer_beside_its_better_half_than_what_it_gains_allows(lag, likelier):
    fitter, _ = recalibrated(Tank(recorded({"leak": 4e-3, "lag": lag})))
    (_, leak), (_, both) = assessed(fitter, leak=3e-3), assessed(fitter, leak=3e-3, lag=2.0)
    half, pair = doubted([leak, both], [0.0, 1000.0], min(leak.excess, both.excess, 0.0))
    assert (pair > half) == likelier
    assert (half > 0.0) == likelier  # the pair vouches for it; else the pair is lowered
    assert (pair == 1000.0) == likelier


def test_a_cause_that_got_stuck_alone_is_fitted_again_from_where_the_best_pair_has_it():
    fitter, _ = recalibrated(Tank(recorded({"leak": 4e-3})))
    (stuck, fitted), (_, pair) = assessed(fitter, leak=1e-4), assessed(fitter, leak=3e-3, lag=1.0)
    mended = {found.name: found for found in with_halves(fitter, [stuck], [pair], Fits(fitter.plant))}
    assert mended[("leak",)].log_evidence == pytest.approx(fitted.log_evidence, abs=1.0)
    assert fitted.log_evidence > stuck.log_evidence + 100.0
    assert set(mended) == {("leak",), ("lag",)}


def test_the_same_recordings_give_the_same_verdict():
    one, other = (which(Tank(recorded({"leak": 2e-3}))) for _ in range(2))
    assert one.probability == other.probability


def test_held_out_runs_are_not_fitted_to():
    tank = Tank(recorded({"c": 0.021}))
    fitter, point = recalibrated(tank)
    tank.runs[2].measured[:] += 0.5
    _, again = recalibrated(tank)
    assert fitter.fitted == [0, 1]
    np.testing.assert_array_equal(point.vector, again.vector)


def test_stretches_keep_every_sample():
    series = np.arange(1.0, 24.0)
    cut = stretches(series, 1e-3)
    assert cut.shape == (5, 5)
    np.testing.assert_array_equal(cut.ravel()[:23], series)
