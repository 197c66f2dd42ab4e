"""From probabilities to a verdict."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from identification.gap.fit.fitter import Hypothesis
from identification.gap.locate.fault_localisation import Forcing, Where
from identification.gap.model.grey_box import Cause, Equation
from identification.gap.rank.evidence import Assessed
from identification.gap.rank.ranking import Verdicts
from identification.gap.rank.verdict import (
    AMBIGUOUS,
    KNOWN,
    NO_GAP,
    UNKNOWN,
    Ranked,
    components,
    conclude,
    ranked,
    smallest,
)
from tests.identification.gap.tanks import diagnosed

LEAK = Cause(name="leak", component="tank", sizes=())
STEAM = Cause(name="evaporation", component="tank", sizes=())
LAG = Cause(name="lag", component="sensor", sizes=())
FAST, SLOW = (Cause(name="lag", component="sensor", sizes=(), variant=v) for v in ("fast", "slow"))


SOUND = diagnosed("no_gap")


def assessed(*causes: Cause) -> Assessed:
    none = SOUND.verdicts.none
    point = replace(none.point, hypothesis=Hypothesis(causes=causes))
    return replace(none, point=point, log_evidence=0.0, with_leftover=0.0)


def verdicts(found: list[tuple[tuple[Cause, ...], float]], no_cause=0.0, unknown=0.0) -> Verdicts:
    return replace(
        SOUND.verdicts,
        candidates=[assessed(*causes) for causes, _ in found],
        probability=[probability for _, probability in found],
        no_cause=no_cause,
        unknown=unknown,
    )


def where(**shares: float) -> Where:
    """Equations by component, one each."""
    forcings = [
        Forcing(
            equation=Equation(name=f"d{component}", state="", component=component, unit="", step=1.0),
            log_evidence=0.0, explained=0.0, windows=[], forcing=np.zeros(0), sd=np.zeros(0),
        )
        for component in shares
    ]  # fmt: skip
    equation = {f"d{component}": share for component, share in shares.items()}
    return replace(SOUND.where, equation=equation, none=1.0 - sum(shares.values()), forcings=forcings)


@pytest.mark.parametrize("seed", range(20))
def test_no_smaller_set_holds_as_much(seed):
    share = np.sort(np.random.default_rng(seed).dirichlet(np.full(6, 0.7)))[::-1] * 0.8
    causes = [Ranked(effects=(str(i),), probability=p, found=assessed()) for i, p in enumerate(share)]
    found = smallest(causes, 0.9)
    assert sum(cause.probability for cause in found) >= 0.9 * 0.8 - 1e-12
    for fewer in combinations(share, len(found) - 1):
        assert sum(fewer) < 0.9 * 0.8
    assert found == causes[: len(found)]


def test_variants_of_a_cause_count_together_and_the_likelier_stands_for_them():
    found = ranked(verdicts([((LEAK,), 0.4), ((FAST,), 0.35), ((SLOW,), 0.25)]))
    assert [(cause.effects, cause.probability) for cause in found] == [
        (("lag",), pytest.approx(0.6)),
        (("leak",), 0.4),
    ]
    assert found[0].found.name == ("lag (fast)",)


def test_a_pair_is_the_same_either_way_round():
    found = ranked(verdicts([((LEAK, FAST), 0.5), ((SLOW, LEAK), 0.3)]))
    assert [set(cause.effects) for cause in found] == [{"leak", "lag"}]
    assert found[0].probability == pytest.approx(0.8)


def test_single_causes_and_the_unknown_share_out_all_probability():
    found = components(
        verdicts([((LEAK,), 0.4), ((STEAM,), 0.1), ((LAG,), 0.2)], unknown=0.3),
        where(tank=0.6, pipe=0.2),
    )
    assert found == {
        "tank": pytest.approx(0.5 + 0.3 * 0.75),
        "sensor": pytest.approx(0.2),
        "pipe": pytest.approx(0.3 * 0.25),
    }
    assert sum(found.values()) == pytest.approx(1.0)
    assert next(iter(found)) == "tank"


def test_a_pair_points_at_each_of_its_components_once():
    found = components(verdicts([((LEAK, LAG), 0.6), ((LEAK, STEAM), 0.4)]), where(tank=1.0))
    assert found == {"tank": pytest.approx(1.0), "sensor": pytest.approx(0.6)}


@pytest.mark.parametrize(
    ("found", "no_cause", "unknown", "verdict", "names"),
    [
        ([((LEAK,), 0.9795), ((LAG,), 0.02)], 0.0005, 0.0, KNOWN, [("leak",)]),
        ([((LEAK,), 0.55), ((LAG,), 0.45)], 0.0, 0.0, AMBIGUOUS, [("leak",), ("lag",)]),
        ([((LEAK,), 0.3), ((LAG,), 0.01)], 0.0, 0.69, UNKNOWN, []),
        ([((LEAK,), 0.99)], 0.01, 0.0, NO_GAP, []),
        ([], 1.0, 0.0, NO_GAP, []),
    ],
)
def test_verdicts(found, no_cause, unknown, verdict, names):
    conclusion = conclude(verdicts(found, no_cause, unknown), where(tank=1.0))
    assert conclusion.verdict == verdict
    assert [cause.effects for cause in conclusion.ambiguity] == names
