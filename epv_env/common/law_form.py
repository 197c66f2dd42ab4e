"""The form of a law: g is linear between equally spaced knots of a state, and constant beyond them."""

KNOTS = 9
"""Knots of g: a smooth law of physics bends once or twice."""

MOST_LAWS = 4
"""Most laws that act at once."""
