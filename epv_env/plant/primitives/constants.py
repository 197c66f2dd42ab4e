"""Constants of geometry."""

QUARTER_PI = 0.7853981633974483
"""pi/4: area of a circle over its squared diameter [-]."""
