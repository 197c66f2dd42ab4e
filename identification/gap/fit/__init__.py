"""Hypotheses and their fits to the recordings."""
