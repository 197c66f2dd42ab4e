"""Labels of sets of causes on the axes of figures: a line for each cause."""

from collections.abc import Iterable


def wrapped(label: str) -> str:
    """The label of a set of causes with a line for each."""
    return label.replace(" + ", "\n+ ")


def row_height(labels: Iterable[str]) -> float:
    """Height of a row that has room for each of these labels, relative to that of one cause [1]."""
    lines = max((1 + label.count(" + ") for label in labels), default=1)
    return max(1.0, 0.5 * lines)
