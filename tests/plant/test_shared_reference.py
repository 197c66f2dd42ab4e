"""The reference runs that came with the task, written by another implementation of the model."""

from pathlib import Path

import numpy as np
import pytest

from epv_env.common.units import BAR, MILLIMETRE
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised, simulate

FOLDER = Path(__file__).parents[3] / "shared" / "reference"
RUNS = ("test1", "test2", "test3", "test4", "validation", "consumption")

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"the reference runs are not at {FOLDER}")


@pytest.mark.parametrize("name", RUNS)
def test_agrees_with_another_implementation(name):
    run = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", names=True)
    p1, p = run["p1_bar"] * BAR, Parameters.calibrated()
    start = energised(p, p1=p1[0], p2=run["p2_bar"][0] * BAR, U=run["U_V"][0])
    found = simulate(
        p, initial=start, U=run["U_V"], period=run["time_s"][1], sigma_S=run["sigmaS_kg_per_s"], p1=p1
    ).state
    moving = (run["xMV_mm"] > 0) & (run["xMV_mm"] < p["xMVmax"] / MILLIMETRE)
    assert np.max(np.abs(found.p2 / BAR - run["p2_bar"])) < 1e-3
    assert np.max(np.abs(found.p3 / BAR - run["p3_bar"])) < 1e-3
    assert np.max(np.abs(found.I - run["I_A"])[~moving]) < 0.5e-3
    assert np.max(np.abs(found.I - run["I_A"])) < 2e-3
    assert np.max(np.abs(found.xMV / MILLIMETRE - run["xMV_mm"])) < 5e-3
