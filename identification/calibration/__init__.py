"""Fitting parameters to recordings (section 6.2)."""
