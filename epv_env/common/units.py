"""SI values of the units used at interfaces."""

BAR = 1e5
"""One bar [Pa]."""
