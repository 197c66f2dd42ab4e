"""Settings of the experiment design."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class DesignSettings:
    """Judgement in the choice of the next experiment."""

    most_rivals: int = 4
    """Most hypotheses between which an experiment is to decide; computing time."""

    probability_held_by_rivals: float = 0.99
    """Share of the probability of all named hypotheses that the rivals hold [1]; at least two rivals."""

    least_variance: float = 1e-10
    """Variance of a direction of outcomes, relative to the widest one [1], below which the direction is
    left out as rounding."""

    outcomes: int = 1000
    """Number of simulated outcomes of each rival over which an experiment is averaged: expected
    probabilities are then known to 0.02 or better."""

    form_error: float = 0.1
    """Relative standard deviation by which a cause's effect may differ from our form in one segment [1]:
    textbook forms are accurate to some percent."""

    segment_duration: float = 5e-3
    """Time over which the error of a form is taken as constant [s]: about one transient of the valve."""
