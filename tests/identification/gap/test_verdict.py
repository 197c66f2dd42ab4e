"""From probabilities to a verdict."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from identification.block_bootstrap import Interval
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.fitting_problem import Hypothesis
from identification.gap.judge.held_out import RECALIBRATED, DiscrepancyReduction
from identification.gap.judge.verdict import (
    AMBIGUOUS,
    EXPLAINED_GAP,
    KNOWN,
    MOST,
    NO_GAP,
    PARTIAL,
    UNKNOWN,
    RankedCause,
    Ranking,
    causes_by_name,
    component_probabilities,
    conclude,
    smallest_set,
)
from identification.gap.locate.localisation import ForcingEstimate, Localisation
from identification.gap.plant import Cause, StateEquation
from tests.identification.gap.tanks import diagnosed

LEAK = Cause(name="leak", component="tank", parameters=())
STEAM = Cause(name="evaporation", component="tank", parameters=())
LAG = Cause(name="lag", component="sensor", parameters=())
FAST, SLOW = (Cause(name="lag", component="sensor", parameters=(), variant=v) for v in ("fast", "slow"))


def sound() -> Diagnosis:
    """A diagnosis without a gap, whose parts are replaced."""
    return diagnosed("no_gap")


BOTH_OR_ONE = [("leak", "lag"), ("leak",)]


def evaluated(*causes: Cause) -> EvaluatedHypothesis:
    recalibrated = sound().ranking.recalibrated
    estimate = replace(recalibrated.estimate, hypothesis=Hypothesis(causes=causes))
    return replace(recalibrated, estimate=estimate)


def ranking(found: list[tuple[tuple[Cause, ...], float]], no_cause=0.0, unknown=0.0) -> Ranking:
    """Hypotheses with their probabilities."""
    return replace(
        sound().ranking,
        hypotheses=[evaluated(*causes) for causes, _ in found],
        probabilities=[probability for _, probability in found],
        no_cause=no_cause,
        unknown=unknown,
    )


def leaving(gap: float, predictable: bool = False, most: float = 1.0) -> DiscrepancyReduction:
    """Every model leaves a gap [noise deviations] on held-out recordings; a cause closes at `most`."""
    left = replace(sound().reduction.unexplained, still_predictable=predictable)
    whole = Interval(value=gap, low=gap, high=gap)
    return replace(
        sound().reduction,
        unexplained=left,
        recalibration_leaves=left,
        shares_closed={RECALIBRATED: Interval(value=most, low=0.0, high=most)},
        gaps={label: replace(each, overall=whole) for label, each in sound().reduction.gaps.items()},
    )


def localisation(**shares: float) -> Localisation:
    """Equations by component, one each."""
    forcings = [
        ForcingEstimate(
            equation=StateEquation(
                name=f"d{component}", state="", component=component, unit="", step=1.0
            ),
            log_evidence=0.0, explained=0.0, windows=[], forcing=np.zeros(0), sd=np.zeros(0),
        )
        for component in shares
    ]  # fmt: skip
    equations = {f"d{component}": share for component, share in shares.items()}
    return replace(
        sound().localisation,
        equation_probabilities=equations,
        nothing_missing=1.0 - sum(shares.values()),
        forcings=forcings,
    )


@pytest.mark.parametrize("seed", range(5))
def test_no_smaller_set_holds_as_much(seed):
    share = np.sort(np.random.default_rng(seed).dirichlet(np.full(6, 0.7)))[::-1] * 0.8
    causes = [
        RankedCause(effects=(str(i),), probability=p, hypothesis=evaluated())
        for i, p in enumerate(share)
    ]
    found = smallest_set(causes, 0.9)
    assert sum(cause.probability for cause in found) >= 0.9 * 0.8 - 1e-12
    for fewer in combinations(share, len(found) - 1):
        assert sum(fewer) < 0.9 * 0.8
    assert found == causes[: len(found)]


def test_variants_of_a_cause_count_together_and_the_likelier_stands_for_them():
    found = causes_by_name(ranking([((LEAK,), 0.4), ((FAST,), 0.35), ((SLOW,), 0.25)]))
    assert [(cause.effects, cause.probability) for cause in found] == [
        (("lag",), pytest.approx(0.6)),
        (("leak",), 0.4),
    ]
    assert found[0].hypothesis.labels == ("lag (fast)",)


def test_single_causes_and_the_unknown_share_out_all_probability():
    found = component_probabilities(
        ranking([((LEAK,), 0.4), ((STEAM,), 0.1), ((LAG,), 0.2)], unknown=0.3),
        localisation(tank=0.6, pipe=0.2),
    )
    assert found == {
        "tank": pytest.approx(0.5 + 0.3 * 0.75),
        "sensor": pytest.approx(0.2),
        "pipe": pytest.approx(0.3 * 0.25),
    }
    assert sum(found.values()) == pytest.approx(1.0)
    assert next(iter(found)) == "tank"


ONE, RIVALS = [((LEAK,), 0.97), ((LAG,), 0.01)], [((LEAK,), 0.5), ((LAG,), 0.4)]
SETS = [((LEAK, LAG), 0.55), ((LEAK,), 0.42)]


@pytest.mark.parametrize(
    ("found", "others", "gap", "verdict", "names"),
    [
        (ONE, (0.0, 0.02), 1.0, KNOWN, [("leak",)]),
        (ONE, (0.02, 0.0), 1.0, KNOWN, [("leak",)]),
        ([((LEAK,), 0.8)], (0.0, 0.2), 1.0, PARTIAL, [("leak",)]),
        (RIVALS, (0.0, 0.1), 1.0, AMBIGUOUS, [("leak",), ("lag",)]),
        (SETS, (0.0, 0.03), 1.0, AMBIGUOUS, BOTH_OR_ONE),
        (ONE, (0.0, 0.02), 1.3, PARTIAL, [("leak",)]),
        (SETS, (0.0, 0.03), 1.3, PARTIAL, BOTH_OR_ONE),
        ([((LEAK,), 0.45), ((LAG,), 0.4)], (0.0, 0.15), 1.3, AMBIGUOUS, [("leak",), ("lag",)]),
        ([((LEAK,), 0.3), ((LAG,), 0.01)], (0.0, 0.69), 1.0, UNKNOWN, []),
        ([((LEAK,), 0.3)], (0.3, 0.4), 1.0, UNKNOWN, []),
        ([((LEAK,), 0.3)], (0.4, 0.3), 1.0, NO_GAP, []),
        ([((LEAK,), 0.2), ((LAG,), 0.2)], (0.3, 0.3), 1.0, AMBIGUOUS, [("leak",), ("lag",)]),
        ([], (1.0, 0.0), 1.0, NO_GAP, []),
        ([], (1.0, 0.0), 40.0, NO_GAP, []),
    ],
)
def test_the_likeliest_decides_and_the_gap_that_causes_leave(found, others, gap, verdict, names):
    given = ranking(found, *others)
    conclusion = conclude(given, localisation(tank=1.0), leaving(gap))
    assert conclusion.verdict == verdict
    assert [cause.effects for cause in conclusion.ambiguity_set] == names


@pytest.mark.parametrize(("excess", "verdict"), [(1e-3, PARTIAL), (-1e-3, UNKNOWN)])
def test_a_cause_that_surely_closes_less_than_half_is_not_named(excess, verdict):
    reduction = leaving(1.3, most=MOST + excess)
    assert conclude(ranking(ONE), localisation(tank=1.0), reduction).verdict == verdict


@pytest.mark.parametrize(
    ("found", "others", "verdict"),
    [
        (ONE, (0.0, 0.02), PARTIAL),
        (SETS, (0.0, 0.03), PARTIAL),
        (RIVALS, (0.0, 0.1), PARTIAL),
        ([], (1.0, 0.0), UNKNOWN),
    ],
)
def test_what_can_still_be_predicted_is_never_explained_away(found, others, verdict):
    given = ranking(found, *others)
    found_verdict = conclude(given, localisation(tank=1.0), leaving(1.0, predictable=True)).verdict
    assert found_verdict == verdict


@pytest.mark.parametrize(("excess", "verdict"), [(-1e-3, KNOWN), (1e-3, PARTIAL)])
def test_a_known_cause_leaves_up_to_a_third_of_the_noise_s_variance(excess, verdict):
    given = conclude(ranking(ONE), localisation(tank=1.0), leaving(EXPLAINED_GAP + excess))
    assert given.verdict == verdict
    assert np.square(EXPLAINED_GAP) - 1.0 == pytest.approx(1 / 3, rel=0.05)


def test_an_effect_is_included_wherever_it_takes_part():
    found = ranking([((LEAK, FAST), 0.5), ((SLOW,), 0.3), ((STEAM,), 0.1)], unknown=0.1).inclusion
    assert list(found) == ["lag", "leak", "evaporation"]
    assert found == {"lag": pytest.approx(0.8), "leak": pytest.approx(0.5), "evaporation": 0.1}
