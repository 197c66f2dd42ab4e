"""The valve's next experiment: programmes that the bench can run, chosen between known rivals."""

from dataclasses import replace
from functools import cache

import numpy as np

from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE, Programme, load_programmes, save_programmes
from identification.bench.session import measured_campaign, run_programme
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.experiment_design import Rivals
from identification.gap.verdict import AMBIGUOUS, PARTIAL, UNKNOWN, Ranking
from identification.report_2003 import Case
from identification.valve_gap.programmes import (
    CANDIDATES,
    next_experiment,
    planned,
    sentence,
)
from identification.valve_gap.valve import Valve

CONFUSED = ("seat_leak", "circuit_leak")
"""Both change a circuit that is shut; only where the supply is far above it do they part."""


@cache
def valve() -> Valve:
    """A leaking seat, recorded by one opening."""
    truth = Parameters.calibrated().replace(A_PV=2e-8)
    programmes = [p for p in DIAGNOSIS_SUITE if p.name in ("test1", "rest")]
    plant = Valve(measured_campaign([run_programme(truth, p) for p in programmes], truth, seed=3))
    plant.causes = tuple(cause for cause in plant.causes if cause.name in CONFUSED)
    return plant


@cache
def diagnosed() -> Ranking:
    return rank_hypotheses(valve())


def programme(name: str, p1: float, p2: float, *openings: float) -> Programme:
    case = Case(name=name, openings=openings, duration=0.6)
    return Programme(name=name, role="calibration", case=case, p1=p1 * BAR, p2=p2 * BAR, U_on=24.0)


def test_the_candidates_are_programmes_of_the_bench(tmp_path):
    assert 40 <= len(CANDIDATES) <= 60
    save_programmes(CANDIDATES, tmp_path / "all.json")
    read = load_programmes(tmp_path / "all.json")
    assert [replace(p, case=replace(p.case, name="")) for p in read] == [
        replace(p, case=replace(p.case, name="")) for p in CANDIDATES
    ]
    assert all(9 * BAR <= p.p1 <= 12.5 * BAR and 4.5 * BAR <= p.p2 <= 8 * BAR for p in CANDIDATES)
    assert all(20 <= p.U_on <= 28 and p.case.duration <= 3.0 for p in CANDIDATES)


def test_a_plan_predicts_what_the_bench_then_measures():
    """The supply of the real bench falls a little; the plan's does not."""
    chosen = programme("opening", 9.5, 5.0, 0.12)
    plan = planned(valve(), [chosen])
    truth = run_programme(Parameters.calibrated(), chosen, reservoir=np.inf)
    values = {s: np.array([Parameters.calibrated()[s]]) for s in ("alphaMV", "alphaPV", "RML", "R")}
    found = plan.outputs(values, [0])[0][:, :, 0]
    expected = np.stack([truth.channels[name] for name in ("p2", "p3", "I")])
    noise = np.array([channel.noise for channel in plan.channels])
    assert np.all(np.sqrt(np.mean((found - expected) ** 2, axis=1)) < noise)


def test_the_telling_programme_is_chosen():
    """Leaks need time and pressure to be seen."""
    blink = programme("blink", 12.0, 8.0, 0.002)
    quiet = replace(blink, case=replace(blink.case, duration=0.06))
    telling = replace(blink, name="hold", p1=12.5 * BAR, p2=4.5 * BAR)
    found = next_experiment(diagnosed(), valve(), AMBIGUOUS, [quiet, telling])
    assert found.programme == telling
    first, second = found.options
    assert second.programme == quiet
    assert first.information.expected_entropy < second.information.expected_entropy
    assert "12.5 bar supply into 4.5 bar" in found.text
    assert next_experiment(diagnosed(), valve(), AMBIGUOUS, [quiet, telling]).text == found.text


def test_what_nothing_explains_asks_for_no_programme():
    found = next_experiment(diagnosed(), valve(), UNKNOWN, CANDIDATES[:1])
    assert found.programme is None
    assert found.text.startswith("No cause of the catalogue explains")


def test_what_is_named_but_for_a_remainder_asks_for_no_programme():
    """Programmes tell hypotheses apart; what remains has no hypothesis."""
    others = [0.0] * (len(diagnosed().probabilities) - 1)
    sure = replace(diagnosed(), probabilities=[1.0, *others], no_cause=0.0, unknown=0.0)
    found = next_experiment(sure, valve(), PARTIAL, CANDIDATES[:1])
    assert found.programme is None
    assert "what remains beside it has no name" in found.text
    assert "shape of the missing term" in found.text


def test_the_sentence_tells_splitting_from_not_splitting():
    estimates = tuple(each.estimate for each in diagnosed().hypotheses[:2])
    rivals = Rivals(estimates=estimates, probability=(0.55, 0.45))
    found = next_experiment(diagnosed(), valve(), AMBIGUOUS, [programme("opening", 9.0, 5.0, 0.4)])
    (option,) = found.options
    sharp = replace(option, information=replace(option.information, expected_best=0.98))
    text = sentence(sharp, rivals)
    assert text.startswith("Record one opening of 400 ms from 9 bar supply into")
    assert "expected to bring 55:45 between" in text
    assert "to 98:2 (epv bench --programme next.json --out next)" in text
    blunt = replace(option, information=replace(option.information, expected_best=0.6))
    assert sentence(blunt, rivals).startswith("No feasible programme splits")
    sure = replace(rivals, probability=(0.999, 0.001))
    assert sentence(sharp, sure).startswith("None is needed")
