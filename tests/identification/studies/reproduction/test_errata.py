"""What the report's figures say when they are checked against each other."""

import json

import pytest

from identification.recordings.recording import CHANNELS
from identification.report_2003.printed_values import printed_errors
from identification.studies.reproduction.errata import checks_table, errata, errata_json, figure_checks
from identification.studies.reproduction.error_table_errata import recomputed_partial, recomputed_total
from identification.studies.reproduction.figure_check import (
    DOUBT,
    ERRATUM,
    HOLDS,
    STATUS_LABELS,
    numeric_check,
)
from identification.studies.reproduction.noise_errata import signal_to_noise
from identification.studies.reproduction.parameter_errata import interval_position, measurement_points

STATUS = {check.where: check.status for check in figure_checks()}


def test_total_error_of_table_13_is_not_what_eq_21_gives():
    assert recomputed_total(13) == pytest.approx(6.8297, abs=1e-4)
    assert STATUS["Table 13, total error [%]"] == ERRATUM


def test_total_error_of_table_11_and_all_partial_errors_hold():
    assert STATUS["Table 11, total error [%]"] == HOLDS
    partials = [status for where, status in STATUS.items() if "partial error" in where]
    assert partials == [HOLDS] * 9


def test_a_changed_figure_would_be_an_erratum():
    """The checks can fail: a tenth of a percent more in one output breaks the sum of squares."""
    errors = dict(printed_errors(11)["Test1"])
    errors["I"] *= 1.001
    found = numeric_check("", errors["partial"], recomputed_partial(errors), 1.5e-4)
    assert found.status == ERRATUM


def test_only_p2_s_signal_to_noise_ratio_follows_from_its_standard_deviation():
    fits = [name for name in CHANNELS if STATUS[f"Table 3, SNR of {name} [dB]"] == HOLDS]
    assert fits == ["p2"]
    assert signal_to_noise("p2", 0.0098) == pytest.approx(64.26, abs=0.01)
    assert STATUS["Section 4.1, SNR 'over 62 dB in all cases' [dB]"] == ERRATUM


def test_seven_of_ten_pairs_are_correlated():
    (found,) = [check for check in figure_checks() if "non-correlated" in check.where]
    assert found.recomputed.startswith("7 of 10 pairs beyond ±0.0196")
    assert STATUS["Table 4, symmetry and unit diagonal"] == HOLDS


def test_eq_23_has_negative_degrees_of_freedom():
    assert measurement_points() == 3 * (3 * 1301 + 2101)
    assert STATUS["Eq. 23, degrees of freedom of F(k, v - k, p)"] == ERRATUM


def test_estimates_lie_at_the_upper_ends_of_their_intervals():
    positions = [interval_position(symbol) for symbol in ("alphaMV", "alphaPV", "RML", "R")]
    assert positions == pytest.approx([0.935, 0.881, 0.993, 0.999], abs=1e-3)
    assert [status for where, status in STATUS.items() if "95 % interval" in where] == [DOUBT] * 4


def test_classes_counts_and_domains_hold():
    for where in (
        "Tables 8 and 9, classes",
        "Section 4, samples of the quality record",
        "Section 5.1.3, candidate parameters",
        "Section 5.2.2, parameters retained",
        "Tables 6 and 7, values within their expected domains",
    ):
        assert STATUS[where] == HOLDS


def test_permeability_and_a1_are_errata():
    assert STATUS["Table 5, permeability of vacuum [V s/(A m)]"] == ERRATUM
    assert STATUS["Table 9, a1, total error [%]"] == ERRATUM


def test_every_check_is_named_once_and_can_be_written():
    assert len(STATUS) == len(figure_checks())
    assert set(STATUS.values()) == {HOLDS, ERRATUM, DOUBT}
    assert len(json.dumps(errata_json())) > 1000
    table = checks_table()
    assert [row[1] for row in table.rows[: len(errata())]] == [STATUS_LABELS[ERRATUM]] * len(errata())
