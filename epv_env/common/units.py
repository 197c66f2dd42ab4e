"""SI values of the units used at interfaces, and one spelling of powers in units."""

import re

BAR = 1e5
"""One bar [Pa]."""

MILLISECOND = 1e-3
"""One millisecond [s]."""

GRAM = 1e-3
"""One gram [kg]."""

MILLIGRAM = 1e-6
"""One milligram [kg]."""

MILLIMETRE = 1e-3
"""One millimetre [m]."""


def plain_powers(unit: str) -> str:
    """A unit in which squares and cubes are written with ^: m²/s, m**2/s and m2/s become m^2/s."""
    spelled = unit.replace("²", "^2").replace("³", "^3").replace("**", "^")
    return re.sub(r"([^\W\d_])([23])(?!\w)", r"\1^\2", spelled)
