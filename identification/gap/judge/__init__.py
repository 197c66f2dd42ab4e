"""Probabilities, held-out gaps and the verdict."""
