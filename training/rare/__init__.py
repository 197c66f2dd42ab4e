"""Probabilities of rare episodes, and what a controller can never do."""
