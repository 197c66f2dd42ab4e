"""Fault localisation: which channel, regime and state equation the gap lies in."""
