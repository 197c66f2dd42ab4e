"""A slow valve needs a reserve: what an application draws before it opens."""

from typing import Any

import numpy as np
import pytest

from controllers.privileged_pulse import WITH_RESERVE, PrivilegedPulse
from controllers.pulse import Pulse
from controllers.pulse_simulation import pulse_table
from controllers.reserve import HARDEST_FLOW, MOST_RESERVE, expected_breakdown, reserve_for
from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from epv_env.reward import BAND_BAR

PLANT = Parameters.calibrated()


@pytest.fixture(scope="module")
def table():
    return pulse_table(PLANT)


def test_the_expected_breakdown_is_the_simulated_valves(table):
    """From rest, with the hardest application as the coil is switched off, until the piston lifts."""
    p1, p2, step = 11.0 * BAR, 8.0 * BAR, 0.1e-3
    valves = Valves(1, threads=1)
    valves.set_parameters(np.array([0]), PLANT)
    for field, value in zip(valves.state, energised(PLANT, p1=p1, p2=p2, U=24.0), strict=True):
        field[:] = value
    valves.inputs.U[:] = 0.0
    valves.inputs.sigma_S[:] = HARDEST_FLOW
    while valves.state.xPV[0] == 0:
        valves.advance(step)
    fell = (p2 - valves.state.p2[0]) / BAR
    rest = (np.array([p1, p2 - fell * BAR, p1]) / BAR)[:, None]  # the opening pressure falls with p2
    expected = expected_breakdown(table, table.time_to_open(*rest))
    assert expected[0] == pytest.approx(fell, rel=0.03)


def test_the_reserve_grows_with_the_expected_breakdown_beyond_what_is_tolerated():
    reserve = reserve_for(np.array([0.1, 0.4, 0.6, 9.0]), tolerated=0.4)
    np.testing.assert_allclose(reserve, [0.0, 0.0, 0.2, MOST_RESERVE], atol=1e-12)


def test_a_pulse_holds_a_reserve_only_if_asked(table):
    settings: dict[str, Any] = {
        "trigger": -0.06,
        "aim": 0.125,
        "filter_time": 0.009,
        "look_ahead": 1.5,
        "rounding": 0.8,
    }
    p1, target = np.array([11.0]), np.array([8.0])
    assert Pulse(table=table, **settings)._reserve(p1, target) == 0
    breakdown = expected_breakdown(table, table.time_to_open(p1, target, p1))
    careful = Pulse(table=table, **settings, tolerated=float(breakdown[0]) - 0.1)
    np.testing.assert_allclose(careful._reserve(p1, target), 0.1)


def test_the_informed_pulse_holds_one_only_with_its_settings():
    assert PrivilegedPulse().tolerated == np.inf
    assert PrivilegedPulse(**WITH_RESERVE).tolerated < BAND_BAR
