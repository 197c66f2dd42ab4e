"""The diagnosis on a plant that is not the valve: what is wrong is found, or nothing is."""

from dataclasses import replace

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.recalibration import recalibrate
from identification.gap.verdict import Ranking
from tests.identification.gap.tanks import disturbed, leaking, without_gap


@pytest.mark.parametrize(("name", "size"), [("leak", 4e-3), ("lag", 4.0), ("evaporation", 8e-4)])
def test_the_cause_that_made_the_recordings_is_found_with_its_size(name, size):
    found = rank_hypotheses(Tank(virtual_recordings({"c": 0.021, name: size})))
    best = found.hypotheses[0]
    assert best.labels == (name,)
    assert found.probabilities[0] > 0.7
    assert found.inclusion[name] > 0.9
    fitted = found.problem.values(best.estimate)
    assert fitted["c"] == pytest.approx(0.021, rel=0.02)
    assert fitted[name] == pytest.approx(size, abs=4 * np.sqrt(best.covariance[-1, -1]))
    held_out = np.concatenate([best.residuals[2].ravel()])
    assert np.sqrt(np.mean(held_out**2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_without_a_cause_recalibration_is_enough(seed):
    found = rank_hypotheses(Tank(virtual_recordings({"c": 0.021}, seed=seed)))
    assert found.no_cause > 0.5
    assert found.no_cause + found.unknown + sum(found.probabilities) == pytest.approx(1.0)


def test_what_the_catalogue_lacks_is_unknown():
    """An inflow that is not what was measured: no cause of the list makes steps of its own."""
    found = rank_hypotheses(disturbed())
    assert found.unknown > 0.8
    assert all(probability < 0.1 for probability in found.inclusion.values())


def test_two_causes_are_found_together():
    found = rank_hypotheses(Tank(virtual_recordings({"leak": 4e-3, "lag": 5.0})))
    assert set(found.hypotheses[0].labels) == {"leak", "lag"}
    assert found.probabilities[0] > 0.8
    assert found.inclusion["leak"] > 0.9
    assert found.inclusion["lag"] > 0.9
    assert found.inclusion["evaporation"] < 0.2


def stating(tank: Tank, factor: float) -> Tank:
    """The tank with its noise stated as a multiple of the true one."""
    (channel,) = tank.channels
    tank.channels = (replace(channel, noise=factor * channel.known_noise),)
    return tank


def judgement(found: Ranking) -> dict[str, float]:
    return {"no cause": found.no_cause, "unknown": found.unknown, **found.inclusion}


@pytest.mark.parametrize("tank", [leaking, without_gap, disturbed])
@pytest.mark.parametrize("factor", [0.3, 3.0, 10.0])
def test_a_wrongly_stated_noise_changes_no_judgement(tank, factor):
    right, wrong = rank_hypotheses(tank()), rank_hypotheses(stating(tank(), factor))
    assert judgement(wrong) == pytest.approx(judgement(right), abs=0.05)
    assert wrong.hypotheses[0].labels == right.hypotheses[0].labels


def test_the_same_recordings_give_the_same_verdict():
    one, other = (rank_hypotheses(Tank(virtual_recordings({"leak": 2e-3}))) for _ in range(2))
    assert one.probabilities == other.probabilities


def test_held_out_runs_are_not_fitted_to():
    tank = Tank(virtual_recordings({"c": 0.021}))
    problem, estimate = recalibrate(tank)
    tank.runs[2].measured[:] += 0.5
    _, again = recalibrate(tank)
    assert problem.fitted_runs == [0, 1]
    np.testing.assert_array_equal(estimate.vector, again.vector)
