"""The misfit is eq. 21 less its nuisances, as a function of a vector of scaled parameters."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.calibration.problem import ParameterVector
from identification.calibration.search import TotalError
from identification.replay.replay import responses, total_response_error
from tests.identification.twins import TRUE, problem


def true_vector():
    return problem().vector.scaled(TRUE)


def residuals_of(posed):
    """Of the true parameters, (outputs, samples of all recordings) [noise deviations]."""
    return np.concatenate(posed.evaluated(true_vector()).residuals, axis=1)


def moved(channel, change):
    """How far a change of a channel over time moves the residuals, relative to the readings."""
    recordings = tuple(
        replace(r, **{channel: r.channel(channel) + change(r.time)}) for r in problem().calibration
    )
    after = residuals_of(replace(problem(), calibration=recordings))
    changes = np.concatenate([change(r.time) for r in recordings]) / problem().noise[channel]
    return np.linalg.norm(after - residuals_of(problem())) / np.linalg.norm(changes)


def test_it_is_eq_21_where_nuisances_explain_little():
    z = 1.03 * true_vector()
    without = total_response_error(responses(problem().calibration, problem().vector.parameters(z)))
    assert TotalError(problem())(z) == pytest.approx(without, rel=0.1)
    assert without > 0.02


def test_the_right_model_s_residuals_have_the_size_of_the_noise():
    assert np.sqrt(np.mean(residuals_of(problem()) ** 2)) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("channel", "size"), [("p3", 500.0), ("I", 4e-4)])
def test_a_constant_error_of_the_p3_and_i_sensors_is_not_seen_and_a_drift_is(channel, size):
    assert moved(channel, lambda time: size + 0.0 * time) < 0.01
    assert moved(channel, lambda time: size * time) > 0.3


def test_a_wrong_start_of_p2_is_hardly_seen():
    """200 Pa in the first 40 ms go into the start, out of which the nuisance takes them again."""
    before = residuals_of(problem())
    posed = replace(problem())
    posed.plant.replay.drives = [
        replace(drive, p2_start=drive.p2_start + 200.0) for drive in posed.plant.replay.drives
    ]
    assert np.linalg.norm(residuals_of(posed) - before) < 0.01 * np.linalg.norm(before)


START = Parameters.initial_guess()
FOUR = ParameterVector(CALIBRATED_SYMBOLS, START)


def test_a_set_comes_back():
    parameters = FOUR.parameters(FOUR.scaled(TRUE))
    for symbol in TRUE:
        assert parameters[symbol] == pytest.approx(
            TRUE[symbol] if symbol in FOUR.symbols else START[symbol]
        )


def test_bounds_are_the_ends_of_the_domains():
    for symbol, ends in zip(FOUR.symbols, FOUR.bounds, strict=True):
        assert tuple(ends * START[symbol]) == pytest.approx(table()[symbol].domain)


def test_bounds_rise_for_a_negative_reference_too():
    """a1's domain is symmetric about zero."""
    (ends,) = ParameterVector(("a1",), TRUE.replace(a1=-0.05)).bounds
    assert tuple(ends) == pytest.approx((-2.0, 2.0))


@pytest.mark.parametrize(("z", "end"), [(100.0, 1), (-1.0, 0)])
def test_a_vector_outside_is_moved_to_the_end_of_the_domain(z, end):
    """Exactly, though 0.5 / 0.72 * 0.72 is less than 0.5."""
    moved = FOUR.parameters(np.full(4, z))
    assert [moved[symbol] for symbol in FOUR.symbols] == FOUR.domains[:, end].tolist()
