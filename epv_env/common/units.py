"""SI values of the units used at interfaces."""

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
