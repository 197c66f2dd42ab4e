"""Run parameters suit held-out runs as well, though the readings are not linear in them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.fit import evidence
from identification.gap.fit.fitting_problem import FittingProblem, Hypothesis
from identification.gap.prepare.prepared_plant import prepared
from identification.valve_gap.valve import Valve
from tests.identification.valve_gap.test_diagnose import campaign

WARM, H_COIL = 40.0, 0.02
"""How much warmer the winding begins [K], and its heating [K/J]."""


def found() -> np.ndarray:
    """Warmth at the start of each run (runs,) [K], from readings without noise."""
    plant = prepared(Valve(campaign()))
    heating = next(cause for cause in plant.causes if cause.name == "coil_heating")
    (start,) = heating.run_parameters
    values = {"h_coil": np.array([H_COIL]), start.symbol: np.full((1, len(plant.runs)), WARM)}
    read = plant.outputs(values, range(len(plant.runs)))
    plant.runs = tuple(replace(run, measured=y[..., 0]) for run, y in zip(plant.runs, read, strict=True))
    problem = FittingProblem(plant)
    cold = problem.start(Hypothesis(causes=(heating,)), {"h_coil": H_COIL})
    return start.centre + evidence.with_settled_runs(problem, cold).run_values[:, 0]


def test_every_run_finds_its_own_warmth():
    held_out = [run.held_out for run in Valve(campaign()).runs]
    assert set(held_out) == {False, True}
    assert found() == pytest.approx(WARM, rel=0.01)
