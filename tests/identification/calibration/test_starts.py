"""Searches from several starts are spread, kept and compared; warnings fire where they are meant to."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.common.files import Journal
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.calibration import search
from identification.calibration import search as starts
from identification.calibration.calibrate import calibrate, calibration_section, calibration_warnings
from identification.calibration.problem import ParameterVector, calibration_problem
from identification.calibration.search import (
    METHODS,
    reached_best,
    search_from_all_starts,
    starting_points,
)
from tests.identification.twins import TRUE, calibration, freed, problem, twin

START = Parameters.initial_guess()
FOUR = ParameterVector(CALIBRATED_SYMBOLS, START)

BAD_BASIN = (1.06, 0.92, 4.2, 0.95)
"""Of the reference: with so much reluctance the armature hardly moves."""


@pytest.fixture
def calls(monkeypatch):
    """Searches that end where they start, and what was asked of them."""
    asked, done = [], calibration()

    def searching(method):
        def search(problem, start):
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
    """The simplex ends there; least squares leave it."""
    monkeypatch.setattr(starts, "MOST_EVALUATIONS", 200)
    points = np.array([np.ones(4), BAD_BASIN])
    fits = search_from_all_starts(problem(), points, Journal(tmp_path / "journal", {}))
    assert reached_best(fits["least squares"]).tolist() == [True, True]
    assert reached_best(fits["Nelder-Mead"]).tolist() == [True, False]
    assert fits["Nelder-Mead"][1].error > 5 * fits["Nelder-Mead"][0].error
    turned = {method: searches[::-1] for method, searches in fits.items()}
    usual, bad = (
        [w for w in calibration_warnings(problem(), each) if "starts reach" in w]
        for each in (fits, turned)
    )
    assert usual[0].startswith("Nelder-Mead: 1 of 2 starts reach the least error")
    assert ["usual start" in warning for warning in (*usual, *bad)] == [False, True]


def test_finished_searches_are_not_done_again(tmp_path, calls):
    first = calibrate(problem(), journal=tmp_path / "journal", subject={"of": "a"}, starts=3)
    assert len(calls) == len(set(calls)) == 6
    again = calibrate(problem(), journal=tmp_path / "journal", subject={"of": "a"}, starts=3)
    assert len(calls) == 6
    for method in METHODS:
        pairs = zip(first.fits[method], again.fits[method], strict=True)
        assert all(one.as_json() == other.as_json() for one, other in pairs)


@pytest.mark.parametrize("change", [{"subject": {"of": "b"}}, {"seed": 1}, {"starts": 4}])
def test_searches_of_another_subject_are_neither_used_nor_wiped(tmp_path, calls, change):
    """Another number of starts moves all of them but the first."""
    usual = {"subject": {"of": "a"}, "starts": 3, "seed": 0}
    calibrate(problem(), journal=tmp_path / "journal", **usual)
    calls.clear()
    with pytest.raises(ValueError, match=r"journal holds results with .*, not .*: go on with the same"):
        calibrate(problem(), journal=tmp_path / "journal", **{**usual, **change})
    calibrate(problem(), journal=tmp_path / "journal", **usual)
    assert not calls


@pytest.fixture
def warnings(tmp_path):
    """The warnings of a problem, calibrated from its reference."""

    def sentences_of(problem):
        return calibrate(problem, journal=tmp_path / "journal", subject={}, starts=1).warnings

    return sentences_of


def fits(**changes):
    """The good calibration's fits, with another outcome of every method."""
    return {
        m: [replace(fit, **changes) for fit in searches] for m, searches in calibration().fits.items()
    }


def test_a_good_calibration_has_none_and_its_section_no_doubt():
    assert calibration().warnings == []
    assert [v.status for v in calibration_section(calibration()).verdicts] == ["good"]
    doubted = calibration_section(replace(calibration(), warnings=["the one"]))
    assert [v.text for v in doubted.verdicts if v.status == "doubt"] == ["the one"]


@pytest.mark.parametrize(("symbol", "end"), [("alphaMV", 0), ("R", 1)])
def test_either_end_of_any_domain_counts(symbol, end):
    vector = problem().vector
    z = calibration().best("least squares").z.copy()
    at = vector.symbols.index(symbol)
    z[at] = vector.bounds[at, end]
    on_end = [
        warning for warning in calibration_warnings(problem(), fits(z=z)) if "ends at the end" in warning
    ]
    assert len(on_end) == 2
    assert all(f"of {symbol}'s domain" in warning for warning in on_end)
    assert vector.parameters(z)[symbol] == pytest.approx(vector.domains[at, end])


def test_a_search_that_is_cut_short_is_not_trusted(warnings, monkeypatch):
    monkeypatch.setattr(search, "MOST_EVALUATIONS", 20)
    sentences = warnings(problem())
    assert any("Nelder-Mead has not converged after" in warning for warning in sentences)
    assert not any("least squares has not converged" in warning for warning in sentences)


def test_only_those_are_named_that_cannot_be_separated():
    four = calibration_problem(twin(), free=freed("alphaMV", "R", "V3", "alphaPV"))
    sentences = calibration_warnings(four, fits(z=four.vector.scaled(TRUE)))
    (separate,) = (warning for warning in sentences if "cannot separate" in warning)
    assert "cannot separate alphaMV, V3 (" in separate


def test_recordings_that_the_model_cannot_explain_are_noticed(warnings):
    sentences = warnings(calibration_problem(twin(), free=freed("alphaMV")))
    assert any("misses the recordings by" in warning for warning in sentences)
    assert not any("cannot separate" in warning for warning in sentences)
