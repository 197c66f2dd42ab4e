"""Modes of form: a cause that acts by another law than assumed is found, and the law is said."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identification.gap.evidence import EvaluatedHypothesis, evaluate, misfit
from identification.gap.fitting_problem import FitCache, FittingProblem, Hypothesis
from identification.gap.form_modes import (
    AS_ASSUMED,
    FORM_SD,
    LATE,
    OWN_SIZE,
    form_modes,
    law_in_words,
    laws,
)
from identification.gap.gauss_newton import fit
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Cause, Channel, FreeParameter, Run
from identification.gap.recalibration import recalibrate, with_own_nuisances

PERIOD, SAMPLES, NOISE = 0.5, 240, 1e-3
POWERS = {"assumed": 1.0, "steeper": 1.6}
"""Power of the level by which the leak grows, as the catalogue has it and otherwise."""


def inflow(k: int) -> np.ndarray:
    return 0.3 + 0.25 * np.sign(np.sin(0.05 * (k + 1) * PERIOD * np.arange(SAMPLES)))


def tank(power: float, runs=()) -> OdePlant:
    """h' = q - c sqrt(h) - leak h^power."""
    given = runs or [
        Run(
            name=f"run {k}", held_out=k == 2, time=PERIOD * np.arange(SAMPLES),
            measured=np.ones((1, SAMPLES)), trusted=np.ones((1, SAMPLES), dtype=bool),
            inputs={"q": inflow(k)},
        )
        for k in range(3)
    ]  # fmt: skip

    def free(symbol: str, nominal: float, high: float) -> FreeParameter:
        return FreeParameter(
            symbol=symbol, unit="1", low=0.0, high=high, nominal=nominal, trials=(0.05,)
        )

    return OdePlant(
        runs=given,
        channels=[Channel(name="h", unit="m", scale=1.0, noise=NOISE)],
        states=("h",),
        rate=lambda x, u, p: (u.q - p.c * np.sqrt(abs(x.h)) - p.leak * abs(x.h) ** power,),
        readings=lambda x, u, p: (x.h,),
        start=lambda run, p: (1.0,),
        parameters=[free("c", 0.2, 1.0)],
        causes=[Cause(name="leak", component="tank", parameters=(free("leak", 0.0, 1.0),))],
        forcing_steps={"h": 1e-3},
        steps_per_sample=4,
    )


@cache
def problem(law: str) -> FittingProblem:
    """Readings of a leaking tank, of which the model assumes a leak in proportion to the level."""
    truth = tank(POWERS[law])
    values = {"c": np.array([0.21]), "leak": np.array([0.1])}
    rng = np.random.default_rng(0)
    runs = [
        replace(run, measured=y[..., 0] + NOISE * rng.normal(size=(1, SAMPLES)))
        for run, y in zip(truth.runs, truth.outputs(values, range(3)), strict=True)
    ]
    return recalibrate(tank(1.0, runs))[0]


@cache
def fits(law: str) -> tuple[EvaluatedHypothesis, EvaluatedHypothesis]:
    """The leak as assumed, and with its modes."""
    given = problem(law)
    leak = Hypothesis(causes=tuple(given.plant.causes))
    plain = evaluate(given, fit(given, [given.start(leak, {"leak": 0.05})]))
    return plain[0], with_own_nuisances(given, plain, "modes", FitCache(given.plant))[0]


def test_a_law_as_assumed_needs_no_mode():
    plain, refined = fits("assumed")
    assert misfit(refined) == pytest.approx(misfit(plain), abs=10.0)
    assert law_in_words(refined.estimate) == AS_ASSUMED


def test_another_law_of_the_same_cause_is_explained_and_said():
    plain, refined = fits("steeper")
    assert misfit(plain) > 10 * misfit(refined)
    assert "grows faster with its size" in law_in_words(refined.estimate)


def test_the_law_that_the_recordings_want_is_the_one_that_acted():
    """The leak's part of h' over the level, where the level often is."""
    given, (_, refined) = problem("steeper"), fits("steeper")
    (law,) = laws(given, refined.estimate)
    h = law.assumed / -given.values(refined.estimate)["leak"]
    slope = np.polyfit(h, law.wanted / h, 1)[0]  # of the leak in proportion to the level, falling
    assert law.term == "dh/dt"
    assert slope < -0.01
    assert np.max(np.abs(law.wanted / law.assumed - 1.0)) > 0.05


def test_the_modes_are_what_the_plant_does_under_the_other_law():
    """A leak that grows a little with its own size, simulated, against the derivative by that mode."""
    given = problem("assumed")
    estimate = fits("assumed")[0].estimate
    forms = form_modes(given, estimate)
    assert forms is not None
    assert forms.names == [OWN_SIZE, LATE]
    h = given.plant.states(given.candidate(estimate), 0)["h"].values
    leak = given.values(estimate)["leak"]
    every = np.concatenate(
        [given.plant.states(given.candidate(estimate), r)["h"].values for r in range(3)]
    )
    mean = np.sum(every**3) / np.sum(every**2)
    sd = np.sqrt(np.sum(every**2 * (every - mean) ** 2) / np.sum(every**2))
    forcing = -0.01 * leak * h * np.clip((h - mean) / sd, -3, 3)
    change = given.plant.forced(given.candidate(estimate), 0, {"dh/dt": forcing[:, None]})
    expected = change[0, :, 0] / NOISE / 0.01 * FORM_SD
    np.testing.assert_allclose(
        forms.slopes[0][:, 0], expected, rtol=0.05, atol=0.02 * np.max(np.abs(expected))
    )
