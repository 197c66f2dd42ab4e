"""What a calibrated parameter absorbs at its usual size, the recordings cannot show."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.gap.black_box_plant import BlackBoxPlant
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.recalibration import recalibrate
from identification.gap.plant import Cause, Channel, FreeParameter, Run
from identification.gap.search.screening import simulate_signatures
from identification.gap.search.separability import assess_separability
from tests.identification.gap.ode_plants import quiet_run

NOISE, SAMPLES = 0.005, 200


def current(p: Mapping[str, float], run: Run) -> NDArray:
    """Limited current through a resistor and a cable, whose resistances add, and a leak."""
    u = run.inputs["u"]
    return np.tanh(u / (p["R"] + p.get("cable", 0.0)))[np.newaxis] + p.get("leak", 0.0) * u * np.abs(u)


def cause(name: str, *trials: float) -> Cause:
    size = FreeParameter(symbol=name, unit="1", low=0.0, high=2.0, nominal=0.0, trials=trials)
    return Cause(name=name, component=name, parameters=(size,))


def resistor(cable: float) -> BlackBoxPlant:
    rng, runs = np.random.default_rng(1), []
    for name in ("first", "second", "validation"):
        run = quiet_run(0.01, SAMPLES, u=np.repeat(rng.uniform(-2.0, 2.0, 10), SAMPLES // 10))
        y = current({"R": 1.0, "cable": cable}, run) + NOISE * rng.standard_normal((1, SAMPLES))
        runs.append(replace(run, name=name, held_out=name == "validation", measured=y))
    return BlackBoxPlant(
        current,
        channels=[Channel(name="i", unit="A", scale=1.0, noise=NOISE)],
        runs=runs,
        parameters=[FreeParameter(symbol="R", unit="Ohm", low=0.2, high=10.0, nominal=1.0)],
        causes=[cause("cable", 0.4), cause("leak", 0.1)],
    )


@pytest.mark.parametrize("cable", [0.0, 0.4, 1.0])
def test_a_cause_that_calibration_absorbs_is_named(cable):
    found = rank_hypotheses(resistor(cable))
    assert found.separability.absorbed == ("cable",)
    assert found.no_cause > 0.9


def test_the_tangent_alone_shows_the_cable():
    """So the steps of the calibrated parameters matter."""
    problem, base = recalibrate(resistor(0.0))
    runs = linearise(problem, [base], problem.fitted_runs)[0]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    assert assess_separability(runs, signatures).absorbed == ()
