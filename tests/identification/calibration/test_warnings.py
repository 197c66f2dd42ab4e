"""Every warning fires on a calibration made for it, and on no other."""

from dataclasses import replace

import pytest

from epv_env.plant.parameters import Parameters
from identification.calibration import search
from identification.calibration.calibrate import calibrate, calibration_section, calibration_warnings
from identification.calibration.problem import calibration_problem
from tests.identification.twins import TRUE, calibration, freed, problem, twin

START = Parameters.initial_guess()


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


def test_coarse_steps_are_said():
    """Their sentence comes first; the rest of the campaign is as good as before."""
    coarse = replace(problem(), steps={"p1": 5e3})
    (warning,) = calibration_warnings(coarse, calibration().fits)
    assert "p1 50 mbar" in warning
