"""Parameters by name and the optimiser's scaled vector are two forms of the same."""

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.calibration.problem import ParameterVector

TRUE, START = Parameters.calibrated(), Parameters.initial_guess()
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
