"""The diagnosis on plants that are not the valve: what is wrong is found, or nothing is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import Diagnosis, diagnose, rank_hypotheses
from identification.gap.judge.verdict import EXPLAINED_GAP, NO_GAP, PARTIAL, Ranking
from identification.gap.report.sentences import verdict_sentence
from tests.identification.gap.drives import Drive
from tests.identification.gap.tanks import disturbed, leaking, struck, without_gap


@pytest.mark.parametrize(("name", "size"), [("leak", 4e-3), ("lag", 4.0), ("evaporation", 8e-4)])
def test_the_cause_that_made_the_recordings_is_found_with_its_size(name, size):
    found = rank_hypotheses(Tank(virtual_recordings({"c": 0.021, name: size})))
    best = found.hypotheses[0]
    assert best.labels == (name,)
    assert found.probabilities[0] > 0.7
    assert found.inclusion[name] > 0.9
    fitted = found.problem.values(best.estimate)
    assert fitted["c"] == pytest.approx(0.021, rel=0.02)
    assert fitted[name] == pytest.approx(size, abs=4 * np.sqrt(best.covariance[-1, -1]))
    held_out = np.concatenate([best.residuals[2].ravel()])
    assert np.sqrt(np.mean(held_out**2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("seed", range(2))
def test_without_a_cause_recalibration_is_enough(seed):
    found = rank_hypotheses(Tank(virtual_recordings({"c": 0.021}, seed=seed)))
    assert found.no_cause > 0.5
    assert found.no_cause + found.unknown + sum(found.probabilities) == pytest.approx(1.0)


def test_what_the_catalogue_lacks_is_unknown():
    found = rank_hypotheses(struck())
    assert found.unknown > 0.8
    assert all(probability < 0.1 for probability in found.inclusion.values())


def test_a_disturbance_that_no_input_foretells_is_no_gap_however_large():
    found = diagnose(disturbed())
    assert found.conclusion.verdict == NO_GAP
    assert found.reduction.gaps["recalibrated"].overall.value > 5.0
    status, text = verdict_sentence(found)
    assert status == "doubt"
    assert text.startswith("Nothing in what recalibration leaves can be predicted from the inputs")


def stating(tank: Tank, factor: float) -> Tank:
    """The tank with its noise stated as a multiple of the true one."""
    (channel,) = tank.channels
    tank.channels = (replace(channel, noise=factor * channel.known_noise),)
    return tank


def judgement(found: Ranking) -> dict[str, float]:
    return {"no cause": found.no_cause, "unknown": found.unknown, **found.inclusion}


@pytest.mark.parametrize(("tank", "factor"), [(leaking, 0.3), (without_gap, 3.0), (disturbed, 10.0)])
def test_a_wrongly_stated_noise_changes_no_judgement(tank, factor):
    right, wrong = rank_hypotheses(tank()), rank_hypotheses(stating(tank(), factor))
    assert judgement(wrong) == pytest.approx(judgement(right), abs=0.05)
    assert wrong.hypotheses[0].labels == right.hypotheses[0].labels


NEARLY_ALL, A_PART = (0.9, 0.01), (0.3, 0.02)
"""Coupling, and a lag that the catalogue lacks: of which the coupling closes nearly all of the gap, and
two thirds."""


@cache
def beside_a_lag(coupling: float, lag: float) -> Diagnosis:
    return diagnose(Drive({"coupling": coupling, "lag": lag}, names=("coupling", "limit", "drift")))


def test_a_true_cause_that_leaves_a_little_is_named_with_its_probability():
    found = beside_a_lag(*NEARLY_ALL)
    assert found.conclusion.verdict == PARTIAL
    assert 0.9 < found.reduction.shares_closed["coupling"].value < 1.0
    assert found.reduction.left.overall.value > EXPLAINED_GAP
    text = verdict_sentence(found)[1]
    assert text.startswith("coupling closes 9")
    assert "that this is the cause has a probability of" in text
    assert "Add it with coupling = " in text


def test_a_true_cause_that_leaves_much_is_less_sure_and_to_be_added():
    found, sure = beside_a_lag(*A_PART), beside_a_lag(*NEARLY_ALL)
    assert found.best
    assert sure.best
    assert found.best.effects == sure.best.effects == ("coupling",)
    assert found.best.probability < sure.best.probability
    assert 0.5 < found.reduction.shares_closed["coupling"].value < 0.9
    assert found.helps
    assert "coupling" in found.model.names
    assert "do not add" not in verdict_sentence(found)[1]


@pytest.mark.parametrize("sizes", [NEARLY_ALL, A_PART])
def test_what_remains_is_located(sizes):
    """Without equations the lag can only lie in the reading or in its time."""
    found = beside_a_lag(*sizes)
    assert found.remaining is not None
    assert max(found.remaining.equation_probabilities.values()) > 0.5
