"""All trials together: shares with exact intervals, held against the project's bars."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from identification.studies.blind.score import ABSORBED, VERDICTS, Scored
from identification.studies.blind.truth import LEFT_OUT, NONE, ONE, PAIR

KINDS = (NONE, ABSORBED, ONE, PAIR, LEFT_OUT)
ALARMS = ("known", "ambiguous", "unknown")
APART = 1.0
"""Distance of a rival below which no test tells it from the truth in more than 69 % of the cases."""
EDGES = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 1e3)
"""Borders of the bins of explainable gap above the floor."""


@dataclass(frozen=True, kw_only=True)
class Share:
    """How many of how many, with the exact 95 % interval (Clopper & Pearson 1934)."""

    hits: int
    of: int

    @property
    def value(self) -> float | None:
        """None where there is nothing to count."""
        return self.hits / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float]:
        """Without trials anything is possible."""
        if not self.of:
            return 0.0, 1.0
        found = binomtest(self.hits, self.of).proportion_ci()
        return float(found.low), float(found.high)

    def as_json(self) -> dict[str, Any]:
        """JSON-ready."""
        low, high = self.interval
        return {"value": self.value, "low": low, "high": high, "hits": self.hits, "of": self.of}


@dataclass(frozen=True, kw_only=True)
class Bin:
    """Trials with a like explainable gap."""

    low: float
    high: float
    """Ends of the gap above the floor."""
    detected: Share
    first_right: Share


@dataclass(frozen=True, kw_only=True)
class Bar:
    """What the project asks of a diagnosis."""

    name: str
    least: float = -np.inf
    most: float = np.inf

    def met(self, value: float | None) -> bool | None:
        """None where nothing was measured."""
        return None if value is None else self.least <= value <= self.most


BARS = (
    Bar(name="false alarms without an effect", most=0.05),
    Bar(name="truth in the ambiguity set", least=0.95),
    Bar(name="mean size of the ambiguity set", most=1.5),
    Bar(name="first cause right", least=0.90),
    Bar(name="first cause right, where data can tell", least=0.90),
    Bar(name="component right", least=0.95),
    Bar(name="unknown where the effect is struck", least=0.85),
    Bar(name="mean probability on the truth", least=0.85),
    Bar(name="shrink inside its 90 % interval", least=0.85, most=0.95),
    Bar(name="seconds per diagnosis", most=60.0),
)


def shares(trials: Sequence[Scored]) -> dict[str, Share]:
    """Counts by name. Detection and cause are judged where there is something to explain."""
    nothing, absorbed = _of(trials, NONE), _of(trials, ABSORBED)
    caused, struck = _of(trials, ONE, PAIR), _of(trials, LEFT_OUT)
    apart = [trial for trial in caused if trial.rival is None or trial.rival >= APART]
    magnitudes = [m for trial in caused for m in trial.magnitudes]
    shrinks = [trial.shrink for trial in caused if trial.shrink]
    return {
        "false alarms without an effect": _share(nothing, lambda t: t.verdict in ALARMS),
        "no gap where the four absorb it": _share(absorbed, lambda t: t.verdict == "no_gap"),
        "false cause where the four absorb it": _share(
            absorbed, lambda t: t.verdict in ALARMS and not set(t.first) <= set(t.effects)
        ),
        "detected": _share([*caused, *struck], lambda t: t.verdict in ALARMS),
        "truth in the ambiguity set": _share(caused, lambda t: t.in_set),
        "first cause right": _share(caused, lambda t: t.first_right),
        "first cause right, where data can tell": _share(apart, lambda t: t.first_right),
        "first cause right, one cause": _share(_of(trials, ONE), lambda t: t.first_right),
        "first cause right, two effects": _share(_of(trials, PAIR), lambda t: t.first_right),
        "component right": _share(caused, lambda t: t.component_right),
        "component right where the effect is struck": _share(struck, lambda t: t.component_right),
        "unknown where the effect is struck": _share(struck, lambda t: t.verdict == "unknown"),
        "size inside its interval": Share(hits=sum(m.inside for m in magnitudes), of=len(magnitudes)),
        "shrink inside its 90 % interval": Share(hits=sum(s.inside for s in shrinks), of=len(shrinks)),
        "failed": _share(trials, lambda t: t.verdict == "failed"),
    }


def means(trials: Sequence[Scored]) -> dict[str, float | None]:
    """Numbers that are no shares."""
    caused = _of(trials, ONE, PAIR)
    sets = [trial.set_size for trial in caused if trial.set_size]
    errors = [m.error for trial in caused for m in trial.magnitudes]
    seconds = [trial.seconds for trial in trials if trial.seconds is not None]
    return {
        "mean size of the ambiguity set": _or_none(np.mean, sets),
        "mean probability on the truth": _or_none(np.mean, [t.probability for t in caused]),
        "median relative error of a size": _or_none(np.median, errors),
        "seconds per diagnosis": _or_none(np.mean, seconds),
        "longest diagnosis [s]": _or_none(np.max, seconds),
    }


def values(trials: Sequence[Scored]) -> dict[str, float | None]:
    """Every share and mean by name."""
    return {name: share.value for name, share in shares(trials).items()} | means(trials)


def verdict_matrix(trials: Sequence[Scored]) -> NDArray:
    """Trials by kind (KINDS) and verdict (VERDICTS)."""
    found = np.zeros((len(KINDS), len(VERDICTS)), dtype=int)
    for trial in trials:
        found[KINDS.index(trial.kind), VERDICTS.index(trial.verdict)] += 1
    return found


def by_size(trials: Sequence[Scored]) -> list[Bin]:
    """Detection by explainable gap, for trials with one cause or two.

    Also where the four absorb them: below the threshold nothing should be found.
    """
    caused = [t for t in trials if t.kind in (ONE, PAIR, ABSORBED)]
    at = np.digitize([max(t.explainable - 1.0, EDGES[0]) for t in caused], EDGES)
    found = []
    for index, (low, high) in enumerate(pairwise(EDGES), start=1):
        inside = [trial for trial, bin_ in zip(caused, at, strict=True) if bin_ == index]
        detected = _share(inside, lambda t: t.verdict in ALARMS)
        right = _share(inside, lambda t: t.first_right)
        found.append(Bin(low=low, high=high, detected=detected, first_right=right))
    return found


def confusion(pairs: Iterable[tuple[str, str]], rows: Sequence[str], columns: Sequence[str]) -> NDArray:
    """How often each (true, said) pair occurs, (rows, columns)."""
    found = np.zeros((len(rows), len(columns)), dtype=int)
    for true, said in pairs:
        found[rows.index(true), columns.index(said)] += 1
    return found


def _of(trials: Sequence[Scored], *kinds: str) -> list[Scored]:
    return [trial for trial in trials if trial.kind in kinds]


def _share(trials: Sequence[Scored], hit: Callable[[Scored], bool]) -> Share:
    return Share(hits=sum(hit(trial) for trial in trials), of=len(trials))


def _or_none(function: Callable[[list], Any], numbers: list) -> float | None:
    return float(function(numbers)) if numbers else None
