"""Experiment design: which recording would tell rival hypotheses apart."""
