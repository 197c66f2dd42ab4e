"""Twin experiments: the truth comes back, to the digits that the recordings allow."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import ParameterError
from identification.calibration.problem import calibration_problem
from identification.calibration.search import nelder_mead, weighted_least_squares
from identification.recordings.recording import CHANNELS, UNITS, CampaignError
from identification.replay.replay import total_response_error
from tests.identification.twins import TRUE, calibration, exact_problem, freed, problem, twin

TOLERANCE = {"alphaMV": 3e-4, "alphaPV": 9e-4, "RML": 8e-4, "R": 3e-4}
"""Four standard deviations of the estimates with the bench's noise, relative."""


def fitted(problem, method="least squares"):
    start = problem.vector.scaled(problem.vector.reference)
    if method == "least squares":
        return weighted_least_squares(problem, start)
    return nelder_mead(problem, start)


def apart(problem, z):
    """Relative distance of a scaled vector from the truth, (k,)."""
    return z / problem.vector.scaled(TRUE) - 1.0


def assert_near_truth(problem, z):
    for symbol, distance in zip(problem.vector.symbols, apart(problem, z), strict=True):
        assert abs(distance) < TOLERANCE[symbol], symbol


def without_rest(campaign):
    return replace(campaign, recordings=tuple(r for r in campaign.recordings if r.role != "quality"))


@pytest.mark.parametrize("method", ["least squares", "Nelder-Mead"])
def test_without_noise_both_methods_find_table_12_from_table_10(method):
    """What is left is that of the integrators and of the smoothed supply."""
    fit = fitted(exact_problem(), method)
    assert fit.converged
    assert np.max(np.abs(apart(exact_problem(), fit.z))) < 3e-5
    assert fit.error < 0.01


def test_a_wrong_constant_spoils_the_estimate():
    """The mass of the armature delays it by a part of a millisecond."""
    start = exact_problem().vector.reference.replace(mMV=0.0022)
    wrong = replace(exact_problem(), vector=replace(exact_problem().vector, reference=start))
    fit = fitted(wrong)
    assert np.max(np.abs(apart(wrong, fit.z))) > 1e-3
    assert fit.error > 0.1


@pytest.mark.parametrize("method", ["least squares", "Nelder-Mead"])
def test_with_noise_both_methods_find_table_12(method):
    assert_near_truth(problem(), calibration().best(method).z)
    assert (
        total_response_error(calibration().after[method])
        < 0.003
        < 0.01
        < total_response_error(calibration().before)
    )


def test_fewer_parameters_can_be_fitted():
    symbols = ("alphaMV", "alphaPV", "R")
    moved = {symbol: 0.97 * TRUE[symbol] for symbol in symbols}
    posed = calibration_problem(twin(), start=TRUE.replace(**moved), free=freed(*symbols))
    fit = fitted(posed)
    assert fit.z.shape == (len(symbols),)
    assert_near_truth(posed, fit.z)


def test_without_a_record_at_rest_nothing_is_subtracted():
    bare = calibration_problem(without_rest(twin()))
    assert bare.offsets == {}
    np.testing.assert_array_equal(bare.calibration[0].p2, twin().recordings[0].p2)
    fit = fitted(bare)
    assert np.max(np.abs(apart(bare, fit.z))) < 2 * max(TOLERANCE.values())
    assert fit.error == pytest.approx(1.0, abs=0.05)


def test_with_one_the_bench_s_offsets_are():
    for channel in CHANNELS:
        offset, unit = problem().offsets[channel], UNITS[channel][1]
        assert offset.value == pytest.approx(SENSORS[channel].offset * unit, abs=4 * offset.error)
        read = twin().recordings[0].channel(channel) - problem().calibration[0].channel(channel)
        np.testing.assert_allclose(read, offset.value, rtol=1e-6)


def test_the_campaign_s_ambient_is_the_model_s():
    posed = calibration_problem(replace(twin(), temperature=300.0, pressure=0.98e5))
    reference = posed.vector.reference
    assert (reference["T_env"], reference["p_env"]) == (300.0, 0.98e5)


def test_a_campaign_without_a_recording_to_fit_to_is_refused():
    rest = replace(twin(), recordings=twin().with_role("quality"))
    with pytest.raises(CampaignError, match="no recording with role 'calibration': give at least one"):
        calibration_problem(rest)


@pytest.mark.parametrize(
    ("symbols", "message"),
    [
        (("a1", "R"), "a1 starts at 0, from which a relative change leads nowhere: start elsewhere"),
        (("x", "R"), "x cannot be calibrated: choose from .*alphaMV"),
    ],
)
def test_symbols_that_cannot_be_fitted_are_refused(symbols, message):
    with pytest.raises(ParameterError, match=message):
        calibration_problem(twin(), free=freed(*symbols))
