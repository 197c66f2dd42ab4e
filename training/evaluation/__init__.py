"""Running controllers on scenarios, and the figures of the control aims."""
