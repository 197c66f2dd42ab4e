"""The report's error measure, against closed forms."""

import numpy as np
import pytest

from identification.report_2003 import (
    CALIBRATION_CASES,
    SAMPLING_RATE,
    VALIDATION_CASE,
    partial_error,
    relative_error,
    total_error,
)

TIME = np.linspace(0.0, 2.0, 2001)


def test_a_constant_offset_is_its_share_of_the_mean():
    reference = 5.0 + np.zeros_like(TIME)
    assert relative_error(reference, reference + 0.1, TIME) == pytest.approx(0.02)


def test_a_sine_of_error_is_its_effective_value():
    reference = 4.0 + np.zeros_like(TIME)
    error = relative_error(reference, reference + np.sin(2 * np.pi * TIME), TIME)
    assert error == pytest.approx(1 / np.sqrt(2) / 4, rel=1e-6)


def test_table_11_s_partial_errors_and_total_come_from_its_columns():
    """Test1's row of Table 11, and the total over its four partial errors [%]."""
    assert partial_error([np.array(e) for e in (1.7241, 1.9783, 6.5588)]) == pytest.approx(
        7.0643, abs=1e-4
    )
    partials = [np.array(e) for e in (7.0643, 8.1904, 7.2867, 4.7364)]
    assert total_error(partials) == pytest.approx(6.9375, abs=1e-3)


@pytest.mark.parametrize("case", [*CALIBRATION_CASES, VALIDATION_CASE])
def test_the_coil_is_off_as_long_and_as_often_as_stated(case):
    off = case.voltage(24.0, SAMPLING_RATE) == 0
    assert np.sum(off) / SAMPLING_RATE == pytest.approx(sum(case.openings))
    assert np.sum(np.diff(off.astype(int)) == 1) == len(case.openings)
