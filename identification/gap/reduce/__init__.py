"""Discrepancy reduction: how much of the gap a hypothesis removes on held-out recordings."""
