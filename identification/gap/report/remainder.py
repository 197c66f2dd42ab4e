"""What the named causes leave of the gap: how much, where it lies, and which term models it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from identification.gap.diagnosis import Diagnosis
from identification.gap.locate.fault_localisation import Localisation, MissingTerm
from identification.gap.reduce.block_bootstrap import Interval
from identification.gap.reduce.discrepancy_reduction import RECALIBRATED
from identification.gap.reduce.gaps import FLOOR

TERM_FORMAT = "epv-term/1"
"""Format of the file that holds a missing term."""


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """What no named cause explains."""

    share: Interval
    """Of the explainable gap on held-out recordings [1]; 0 where there is nothing to explain."""
    component: Mapping[str, float]
    """Probability that it lies there, by component; empty where it was not located."""
    equation: Mapping[str, float]
    """Probability that it lies there, by equation or reading; empty where it was not located."""
    location: Localisation | None
    """Of the remainder; None where nothing is left to locate."""
    term: MissingTerm | None
    """The missing term over a state; None where no state explains enough of it."""


def remainder(diagnosis: Diagnosis) -> Remainder:
    """What the verdict's first cause leaves; the whole gap where the verdict names none."""
    location = diagnosis.remaining if diagnosis.named else _unnamed(diagnosis)
    return Remainder(
        share=_share_left(diagnosis),
        component=_component_probabilities(location),
        equation=dict(location.equation_probabilities) if location else {},
        location=location,
        term=drawn_term(diagnosis, location),
    )


def drawn_term(diagnosis: Diagnosis, location: Localisation | None) -> MissingTerm | None:
    """The missing term, where one state explains enough of it to be drawn."""
    term = location.missing_term if location else None
    return term if term and term.explained >= diagnosis.settings.report.drawn_term_share else None


def term_table(term: MissingTerm) -> dict[str, Any]:
    """The content of the file that holds a missing term; lists of one number per window."""
    return {
        "format": TERM_FORMAT,
        "equation": term.equation.name,
        "component": term.equation.component,
        "state": term.state,
        "state_unit": term.state_unit,
        "unit": term.equation.unit,
        "explained": term.explained,
        "columns": {
            "state": term.x.tolist(),
            "forcing": term.y.tolist(),
            "sd": term.sd.tolist(),
            "single_window": term.scatter.tolist(),
        },
    }


def _unnamed(diagnosis: Diagnosis) -> Localisation | None:
    """Where the gap lies of which nothing is named; None where there is no gap."""
    return diagnosis.localisation if _explainable(diagnosis) else None


def _explainable(diagnosis: Diagnosis) -> bool:
    """Whether recalibration leaves more than noise."""
    return diagnosis.reduction.gaps[RECALIBRATED].overall.low > FLOOR


def _share_left(diagnosis: Diagnosis) -> Interval:
    """Share of the explainable gap that no named cause closes [1]."""
    whole = 1.0 if _explainable(diagnosis) else 0.0
    if not diagnosis.named:
        return Interval(value=whole, low=whole, high=whole)
    closed = diagnosis.share_closed(diagnosis.named)
    left = diagnosis.reduction.unexplained.fraction
    return Interval(value=left, low=min(1.0 - closed.high, left), high=max(1.0 - closed.low, left))


def _component_probabilities(location: Localisation | None) -> dict[str, float]:
    """Of the equations and readings of each component together, the highest first."""
    total: dict[str, float] = {}
    for forcing in location.forcings if location else ():
        component, name = forcing.equation.component, forcing.equation.name
        share = location.equation_probabilities[name] if location else 0.0
        total[component] = total.get(component, 0.0) + share
    return dict(sorted(total.items(), key=lambda pair: -pair[1]))
