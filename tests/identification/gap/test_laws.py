"""Laws: how the strength of a cause follows a state is found, said, and costs what its prior says."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from epv_env.common.law_form import KNOTS
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import Hypothesis
from identification.gap.fit.gauss_newton import fit
from identification.gap.fit.laws import COMPONENTS, KEPT_VARIANCE, LENGTH, SD, Law, in_words
from identification.gap.judge.verdict import KNOWN
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Cause, Channel, Run
from identification.gap.report.gap_json import as_json
from identification.gap.report.page import drawn_laws
from identification.gap.report.sentences import verdict_sentence
from identification.gap.search.law_screening import law_starts
from identification.gap.search.posterior import misfit_beyond_noise, tolerated_misfit
from tests.identification.gap.ode_plants import decay, free, quiet_run

PERIOD, SAMPLES, NOISE = 0.1, 300, 1e-2
DRAG, GROWTH = 0.3, 0.8
"""Drag at the middle, and its growth with the square of the position, which the catalogue lacks."""


def swing(runs, growth: float = 0.0, mode: str = "python") -> OdePlant:
    """A mass of 1 kg on a spring that is pushed."""

    def rate(x, u, p):
        drag = p.drag * (1.0 + growth * x.s * x.s) * x.v
        return x.v, u.push - p.k * x.s - drag - p.dry * np.tanh(x.v / 0.1) - p.hard * x.s**3

    sizes = [free(name, 0.0, (0.1,)) for name in ("drag", "dry", "hard")]
    return OdePlant(
        runs=runs,
        channels=[Channel(name="s", unit="m", scale=1.0, noise=NOISE)],
        states=("s", "v"),
        rate=rate,
        readings=lambda x, u, p: (x.s,),
        start=lambda run, p: (0.0, 0.0),
        parameters=[free("k", 2.0)],
        causes=[Cause(name=p.symbol, component="arm", parameters=(p,)) for p in sizes],
        forcing_steps={"v": 1e-3},
        steps_per_sample=2,
        mode=mode,
    )


def pushed(number: int, samples: int = SAMPLES) -> Run:
    push = np.repeat(np.random.default_rng(number).uniform(-2.0, 2.0, samples // 10), 10)
    return replace(quiet_run(PERIOD, samples, push=push), name=str(number), held_out=number == 2)


def one(values) -> dict[str, np.ndarray]:
    """Values of one candidate, (1,) each."""
    return {symbol: np.array([value]) for symbol, value in values.items()}


@cache
def diagnosed() -> Diagnosis:
    truth, rng = swing([pushed(number) for number in range(3)], GROWTH), np.random.default_rng(0)
    exact = truth.outputs(one({"k": 2.1, "drag": DRAG}), range(3))
    runs = [
        replace(run, measured=y[..., 0] + NOISE * rng.standard_normal(run.measured.shape))
        for run, y in zip(truth.runs, exact, strict=True)
    ]
    return diagnose(swing(runs, mode="compiled"))


def test_a_strength_that_follows_a_state_is_found():
    ranking, best = diagnosed().ranking, diagnosed().ranking.hypotheses[0]
    assert (diagnosed().conclusion.verdict, best.labels) == (KNOWN, ("drag",))
    ((law, components),) = best.estimate.laws
    assert (law.cause.name, law.argument) == ("drag", "s")
    every = np.concatenate([run.measured[0] for run in ranking.problem.plant.runs])
    knots = np.linspace(law.low, law.high, KNOTS)
    reached = (knots > np.quantile(every, 0.02)) & (knots < np.quantile(every, 0.98))
    assert np.sum(reached) >= 5
    found = ranking.problem.values(best.estimate)["drag"] * (1.0 + law.growth(components))
    assert found[reached] == pytest.approx(DRAG * (1.0 + GROWTH * knots**2)[reached], rel=0.1)
    assert best.squares[0] / len(every) == pytest.approx(1.0, abs=0.1)


def left(name: str, opened: bool) -> float:
    """Misfit of a cause alone, with its law as assumed or with the one that promises most."""
    ranking = diagnosed().ranking
    problem, (cause,) = ranking.problem, (c for c in ranking.problem.plant.causes if c.name == name)
    (fitted,) = fit(problem, [problem.start(Hypothesis(causes=(cause,)), {name: 0.1})])
    if opened:
        starts = law_starts(problem, fitted, [fitted], [cause], problem.fitted_runs)
        (fitted,) = fit(problem, [starts[0].estimate])
    return misfit_beyond_noise(evaluate(problem, [fitted])[0], ranking.noise)


@pytest.mark.parametrize(("name", "opened"), [("drag", False), ("dry", True), ("hard", True)])
def test_another_law_or_cause_leaves_far_more(name, opened):
    tolerated = tolerated_misfit(sum(own.readings for own in diagnosed().ranking.noise))
    assert left(name, opened) > 10 * (left("drag", True) + tolerated)


def test_the_law_is_said_drawn_and_written():
    found, best = diagnosed(), diagnosed().ranking.hypotheses[0]
    ((law, components),) = best.estimate.laws
    growth = law.growth(components)
    words = in_words(best.estimate.laws)
    assert words.startswith(f"the strength of drag follows s: {growth[0]:+.0%} at its least value")
    assert f"The law differs from the one assumed: {words}." in verdict_sentence(found)[1]
    ends = {"effect": "drag", "argument": "s", "low": law.low, "high": law.high}
    assert as_json(found)["causes"][0]["laws"] == [ends | {"growth": growth.tolist()}]
    assert len(drawn_laws(found, best)) == 1
    wide = replace(best, covariance=1e6 * best.covariance)
    assert drawn_laws(found, wide) == [], "its band holds the law that is assumed"


def test_components_are_orthogonal_and_hold_the_prior():
    apart = np.subtract.outer(np.arange(KNOTS), np.arange(KNOTS)) / (KNOTS - 1) / LENGTH
    centred, products = np.eye(KNOTS) - 1.0 / KNOTS, COMPONENTS.T @ COMPONENTS
    prior = centred @ (SD**2 * np.exp(-0.5 * apart**2)) @ centred
    np.testing.assert_allclose(COMPONENTS.sum(axis=0), 0.0, atol=1e-12)  # the size carries the mean
    np.testing.assert_allclose(products, np.diag(np.diag(products)), atol=1e-12)
    assert np.min(np.linalg.eigvalsh(prior - COMPONENTS @ COMPONENTS.T)) > -1e-12
    held = np.cumsum(np.diag(products)) / np.trace(prior)
    assert held[-2] < KEPT_VARIANCE <= held[-1]


@pytest.mark.parametrize("argument", ["s", "v", "push"])
@pytest.mark.parametrize(
    ("growths", "factor"), [((0.0,), 1.0), ((0.5,), 1.5), ((0.25, 0.2), 1.5), ((-2.0,), 0.0)]
)
def test_a_constant_law_is_another_size(argument, growths, factor):
    plant, law = swing([pushed(0, 60)]), {}
    for number, growth in enumerate(growths, start=1):
        ends = plant.causes[0], argument, -0.5, 0.3
        law |= plant.law_values(number, *ends, np.full(KNOTS, growth))
    found = plant.outputs(one({"drag": DRAG} | law), [0])[0]
    expected = plant.outputs(one({"drag": factor * DRAG}), [0])[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_a_law_is_linear_between_knots_and_multiplies_what_a_parameter_has_beyond_its_nominal_value():
    """y' = -k y + gain q, with a law of the gain over q: as another q."""
    q = np.random.default_rng(1).uniform(0.0, 2.0, 21)
    plant = decay([quiet_run(0.5, 21, q=q)], steps_per_sample=2)
    law = Law(cause=plant.causes[0], argument="q", low=0.4, high=1.5)
    components = np.linspace(1.0, -1.0, COMPONENTS.shape[1])
    values = plant.law_values(1, law.cause, "q", law.low, law.high, law.growth(components))
    growth = np.interp(q, law.knots, law.growth(components))
    other = decay([quiet_run(0.5, 21, q=q * (1.4 + 0.4 * growth))], steps_per_sample=2)
    found = plant.outputs(one({"gain": 1.4} | values), [0])[0]
    np.testing.assert_allclose(found, other.outputs({}, [0])[0], rtol=0, atol=1e-12)
    assert np.ptp(growth) > 0.3
