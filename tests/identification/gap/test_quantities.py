"""Numbers as people read them."""

import pytest

from identification.block_bootstrap import Interval
from identification.gap.report.sentences import (
    gap_with_interval,
    probability_text,
    quantity,
    quantity_with_interval,
    share_text,
)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.4e-3, "S", "2.40 mS"),
        (2e-8, "m^2", "0.0200 mm^2"),
        (5e-6, "m^3", "5.00 cm^3"),
        (-5e3, "Pa", "-5.00 kPa"),
        (0.02, "kg", "0.0200 kg"),
        (2e4, "1/m^2", "20000 1/m^2"),
        (0.5, "1", "0.500"),
        (0.0, "V", "0 V"),
        (2.5e-5, "m2/s", "0.250 cm2/s"),
        (2.5e-5, "m²/s", "0.250 cm²/s"),
        (2.5e-5, "m**2/s", "0.250 cm**2/s"),
        (2.5e-5, "m³/s", "0.0250 dm³/s"),
        (2.5e-5, "m^4", "2.5e-05 m^4"),
        (2.5e-5, "m^2.5", "2.5e-05 m^2.5"),
        (2.5e-5, "m s^-2", "25.0 um s^-2"),
    ],
)
def test_a_prefix_scales_its_unit_and_the_unit_s_power(value, unit, text):
    assert quantity(value, unit) == text


def test_an_interval_has_one_unit():
    assert quantity_with_interval(2e-3, 9e-4, 3.1e-3, "s") == "2.00 (0.900 to 3.10) ms"


def test_nothing_is_certain_in_words():
    assert probability_text(1.0) == "> 99 %"
    assert probability_text(0.0) == "< 1 %"
    assert probability_text(0.534) == "53 %"


def test_shares_and_gaps():
    assert share_text(Interval(value=0.99, low=0.97, high=1.0)) == "99 % (97 to 100 %)"
    assert gap_with_interval(Interval(value=1.004, low=0.99, high=12.34)) == "1.00 (0.99 to 12.3)"
