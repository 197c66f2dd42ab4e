"""What to record next: how far apart two answers are in programmes that nobody has recorded."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import load_programmes
from identification.bench.session import run_programme
from identification.gap.fit.fitting_problem import Estimate, FittingProblem, Hypothesis
from identification.gap.judge.verdict import AMBIGUOUS, KNOWN, NO_GAP, UNKNOWN
from identification.report_2003 import Case
from identification.valve_gap.diagnose import _plan
from identification.valve_gap.next_recording import CANDIDATES, next_recording, planned, separation
from identification.valve_gap.valve import Valve
from tests.identification.valve_gap.campaigns import campaign

TRUTH, LEAK = Parameters.calibrated(), {"A_PV": 2e-7}
OPENING = replace(CANDIDATES[0], case=Case(name="opening", openings=(0.12,), duration=0.6))
BLINK = replace(OPENING, p2=8.9e5, case=Case(name="blink", openings=(0.002,), duration=0.06))


@cache
def valve() -> Valve:
    return Valve(campaign("test1", "validation"))


def answer(name: str = "", **sizes: float) -> Estimate:
    causes = tuple(cause for cause in valve().causes if cause.name == name)
    return FittingProblem(valve()).start(Hypothesis(causes=causes), {**TRUTH, **sizes})


def apart(first: Estimate, second: Estimate) -> float:
    return separation(FittingProblem(valve()), planned(valve(), [OPENING]), first, second)[0]


def ranking(leak: float, none: float) -> Any:
    found = [SimpleNamespace(estimate=each) for each in (answer("seat_leak", **LEAK), answer())]
    own = {"hypotheses": found[:1], "probabilities": [leak], "recalibrated": found[1], "no_cause": none}
    return SimpleNamespace(problem=FittingProblem(valve()), **own)


def test_separation_grows_with_the_difference_and_knows_no_other_recordings():
    leaks = [apart(answer(), answer("seat_leak", A_PV=size)) for size in (0.0, 2e-8, 4e-8, 8e-8)]
    assert leaks == sorted({0.0, *leaks})
    cold = answer("coil_heating", h_coil=5.0)
    assert apart(cold, replace(cold, run_values=cold.run_values + 30.0)) == 0.0


def test_a_separation_is_what_the_bench_then_measures():
    bench = [run_programme(p, OPENING, reservoir=np.inf) for p in (TRUTH, TRUTH.replace(**LEAK))]
    without, leaky = (np.array([b.channels[c.name] for c in valve().channels]) for b in bench)
    weighed = (leaky - without) / np.array([[c.known_noise] for c in valve().channels])
    found = apart(answer(), answer("seat_leak", **LEAK))
    assert found == pytest.approx(np.sqrt(np.mean(weighed**2)), rel=0.02)


@pytest.mark.parametrize(
    ("programmes", "probabilities", "verdict", "text"),
    [
        ([BLINK, OPENING], (0.6, 0.4), AMBIGUOUS, "Record one opening of 120 ms from 9 bar supply"),
        ([BLINK], (0.6, 0.4), AMBIGUOUS, "No programme of the bench tells"),
        ([BLINK, OPENING], (0.01, 0.96), NO_GAP, "No further recording is needed (no cause: 96 %)."),
        ([BLINK], (0.2, 0.1), UNKNOWN, "No cause of the catalogue explains the recordings"),
    ],
)
def test_the_programme_that_separates_most_comes_first(programmes, probabilities, verdict, text):
    found = next_recording(ranking(*probabilities), valve(), verdict, programmes)
    assert found.text.startswith(text)
    assert not found.table or found.table.rows == sorted(found.table.rows, key=lambda r: -float(r[1]))


def test_a_law_of_the_same_cause_is_no_other_answer():
    found = ranking(0.5, 0.01)
    found.hypotheses, found.probabilities = found.hypotheses * 2, [0.5, 0.49]  # as assumed, with a law
    text = next_recording(found, valve(), KNOWN, [OPENING]).text
    assert text.startswith("No further recording is needed")
    assert text.endswith("(seat_leak): 99 %).")


def test_the_bench_reads_the_programme_that_is_written(tmp_path):
    found: Any = SimpleNamespace(ranking=ranking(0.5, 0.4), conclusion=SimpleNamespace(verdict=""))
    assert "noise deviations (epv bench --programme next.json" in _plan(found, valve(), tmp_path).text
    assert load_programmes(tmp_path / "next.json")[0].name in [each.name for each in CANDIDATES]
