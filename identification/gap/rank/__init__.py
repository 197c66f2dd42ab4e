"""Hypothesis ranking: screening, refits, evidence, probabilities and the verdict."""
