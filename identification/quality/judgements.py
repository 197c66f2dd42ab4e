"""How a check's figures become a status, and the words that its sentence is made of."""

from typing import NamedTuple

from identification.quality.channel import ChannelAssessment

SEVERITY = ("note", "good", "doubt", "bad")
"""Statuses from harmless to worst; a note says that something could not be judged."""


class Judgement(NamedTuple):
    """What one check says."""

    status: str
    """One of SEVERITY."""
    text: str
    """One sentence: the figures and, unless good, what to do."""


def graded_status(value: float, levels: tuple[float, float]) -> str:
    """Good below the first level, bad from the second on, in doubt between."""
    return SEVERITY[1 + sum(value >= limit for limit in levels)]


def judgement_of(status: str, figures: str, advice: str) -> Judgement:
    """The figures and, unless all is well, what to do."""
    return Judgement(status, figures if status == "good" else f"{figures}; {advice}")


def p_value_text(value: float) -> str:
    """A p-value, which may be too small to print."""
    return f"p = {value:.2g}" if value > 1e-99 else "p < 1e-99"


def milli_text(channel: ChannelAssessment, value: float) -> str:
    """A small value in mA, mV or mbar."""
    return f"{1e3 * value:.3g} m{channel.unit}"
