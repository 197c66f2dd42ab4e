"""Searches from several starts: spread over the domains, kept in the journal, compared at the end."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.common.files import Journal
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.calibration import search as starts
from identification.calibration.calibrate import calibrate, calibration_warnings
from identification.calibration.problem import ParameterVector
from identification.calibration.search import (
    METHODS,
    reached_best,
    search_from_all_starts,
    starting_points,
)
from tests.identification.twins import calibration, problem

START = Parameters.initial_guess()
FOUR = ParameterVector(CALIBRATED_SYMBOLS, START)

BAD_BASIN = (1.06, 0.92, 4.2, 0.95)
"""Of the reference: with so much reluctance the armature hardly moves."""


@pytest.fixture
def calls(monkeypatch):
    """Searches that end where they start, and what was asked of them."""
    asked, done = [], calibration()

    def searching(method):
        def search(misfit, start):
            asked.append((method, tuple(start)))
            error = float(np.sum((start - 1.0) ** 2))
            return replace(done.best(method), start=start, z=start, error=error)

        return search

    monkeypatch.setattr(starts, "nelder_mead", searching("Nelder-Mead"))
    monkeypatch.setattr(starts, "weighted_least_squares", searching("least squares"))
    return asked


def test_starts_are_the_reference_and_others_spread_evenly_over_the_logarithm():
    """A Latin hypercube puts one point into each of as many equal strips."""
    low, high = FOUR.bounds.T
    points = starting_points(FOUR, 41, 0)
    np.testing.assert_array_equal(points[0], np.ones(4))
    share = np.log(points[1:] / low) / np.log(high / low)
    np.testing.assert_array_equal(
        np.sort(np.floor(40 * share), axis=0), np.arange(40)[:, None] + np.zeros(4)
    )


def test_a_start_in_another_basin_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(starts, "MOST_EVALUATIONS", 200)
    points = np.array([np.ones(4), BAD_BASIN])
    fits = search_from_all_starts(problem(), points, Journal(tmp_path / "journal", {}))
    for method in METHODS:
        assert reached_best(fits[method]).tolist() == [True, False]
        assert fits[method][1].error > 5 * fits[method][0].error
    sentences = calibration_warnings(problem(), fits)
    assert [warning.split(":")[0] for warning in sentences] == list(METHODS)
    assert all("1 of 2 starts reach the least error" in warning for warning in sentences)
    assert not any("usual start" in warning for warning in sentences)
    turned = {method: found_fits[::-1] for method, found_fits in fits.items()}
    assert all(
        "the usual start is among" in warning for warning in calibration_warnings(problem(), turned)
    )


def test_finished_searches_are_not_done_again(tmp_path, calls):
    first = calibrate(problem(), journal=tmp_path / "journal", subject={"of": "a"}, starts=3)
    assert len(calls) == len(set(calls)) == 6
    again = calibrate(problem(), journal=tmp_path / "journal", subject={"of": "a"}, starts=3)
    assert len(calls) == 6
    for method in METHODS:
        pairs = zip(first.fits[method], again.fits[method], strict=True)
        assert all(one.as_json() == other.as_json() for one, other in pairs)


@pytest.mark.parametrize("change", [{"subject": {"of": "b"}}, {"seed": 1}, {"starts": 4}])
def test_searches_of_another_subject_are_not_used(tmp_path, calls, change):
    """Another number of starts moves all of them but the first."""
    usual = {"subject": {"of": "a"}, "starts": 3, "seed": 0}
    calibrate(problem(), journal=tmp_path / "journal", **usual)
    calls.clear()
    calibrated = calibrate(problem(), journal=tmp_path / "journal", **{**usual, **change})
    assert len(calls) == 2 * {**usual, **change}["starts"]
    ends = np.array([fit.start for fit in calibrated.fits["Nelder-Mead"]])
    expected = starting_points(problem().vector, len(ends), {**usual, **change}["seed"])
    np.testing.assert_array_equal(ends, expected)
