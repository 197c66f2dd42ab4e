"""Predicted error tables."""

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters, table
from identification.report_2003.printed_values import printed_errors
from identification.studies.error_tables.bench_conditions import drawn_conditions, fitted_conditions
from identification.studies.error_tables.candidates import Candidate, candidates
from identification.studies.error_tables.current_errors import current_residual, winding_contribution
from identification.studies.error_tables.error_prediction import (
    HypotheticalValve,
    lagged,
    predicted_errors,
    printed_calibrated_errors,
    printed_initial_errors,
)

CONDITIONS = fitted_conditions()


def valve(**changes: float) -> HypotheticalValve:
    return Candidate(cause="", changes=changes).valve(CONDITIONS)


def test_the_printed_tables_are_those_of_the_data_file():
    assert printed_calibrated_errors()[0] == pytest.approx([2.6982, 1.6465, 6.6536])
    assert printed_calibrated_errors()[4, 2] == printed_errors(15)["Validation"]["I"]
    assert printed_initial_errors()[3].tolist() == [
        printed_errors(11)["Test4"][o] for o in ("p2", "p3", "I")
    ]


def test_every_effect_and_every_parameter_outside_the_four_is_a_candidate():
    causes = {candidate.cause for candidate in candidates()}
    partly_known = {row.symbol for row in table().values() if row.source == "Table 6"} - {"R"}
    assert causes >= {*CATALOGUE, *(f"parameter:{symbol}" for symbol in partly_known), "none"}
    for candidate in candidates():
        Parameters.calibrated().replace(**candidate.changes)  # within its physical range


def test_without_a_cause_only_the_noise_of_the_sensors_is_left():
    found = predicted_errors(CONDITIONS, [valve()]).calibrated[0]
    mean = current_residual(CONDITIONS).mean
    assert found[:, 2] == pytest.approx(100 * SENSORS["I"].noise / mean, rel=1e-2)
    assert np.all(found[:, :2] < 0.15)


def test_what_the_four_parameters_can_express_leaves_no_gap():
    nominal = Parameters.calibrated()
    off = valve(R=1.05 * nominal["R"], alphaMV=0.9 * nominal["alphaMV"], V2=1.1 * nominal["V2"])
    found = predicted_errors(CONDITIONS, [off, valve()])
    assert found.calibrated[0] == pytest.approx(found.calibrated[1], rel=0.15)
    assert found.z[0] == pytest.approx([0.9, 1 / 1.1, 1.0, 1.05], rel=5e-3)


def test_a_delayed_coil_is_felt_in_the_current_most():
    found = predicted_errors(CONDITIONS, [valve(t_delay=2e-3)]).calibrated[0]
    assert np.all(found[:, 2] > 2 * found[:, :2].max(axis=1))


def test_the_current_s_filter_answers_a_slow_ramp_with_its_time_constant():
    period, time_constant = 5e-4, 4e-3
    time = np.arange(200) * period
    late = np.interp(time - time_constant, time, time)
    assert lagged(time, time_constant, period)[100:] == pytest.approx(late[100:], abs=0.02 * period)


def test_tables_11_and_13_together_show_which_winding_was_warm():
    """A twin: a delay in every switching, and windings that differ by up to 10 K."""
    twin = Candidate(cause="", changes={"t_delay": 2e-3}, winding_deviation=10.0).valve(CONDITIONS)
    found = predicted_errors(CONDITIONS, [twin])
    shown = winding_contribution([CONDITIONS], found.initial[0], found.calibrated[0]).temperature[0]
    assert shown == pytest.approx(10.0 * CONDITIONS.winding_deviation[:4], abs=1.5)


def test_the_same_seed_draws_the_same_conditions():
    first, again, other = (drawn_conditions(np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert first.cases == again.cases
    assert np.array_equal(first.p2, again.p2)
    assert not np.array_equal(first.p2, other.p2)
    for case in first.cases:
        assert case.first + sum(case.openings) + case.pause * (len(case.openings) - 1) < case.duration
