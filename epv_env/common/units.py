"""SI values of the units used at interfaces."""

BAR = 1e5
"""One bar [Pa]."""

MILLISECOND = 1e-3
"""One millisecond [s]."""
