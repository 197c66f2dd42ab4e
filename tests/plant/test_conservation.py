"""Air and energy are neither made nor lost, and no mover leaves its stroke."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import simpson

from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

CALIBRATED = Parameters.calibrated()
N = 40
PERIODS = 200
PERIOD = 5e-3
RESERVOIR = 0.02  # m^3, small so that it sags


@cache
def switched_at_random(restitution=0.0):
    """N valves for 1 s under random switching, consumption and refill.

    Returns (parameters, states at the borders of the periods, inputs); fields of shape
    (PERIODS + 1, N) and (PERIODS, N).
    """
    rng = np.random.default_rng(1)
    p = CALIBRATED.replace(eMV=restitution, ePV=restitution)
    valves = Valves.started(N, p, energised(p, p1=12e5, p2=6e5, U=24.0), reservoir_volume=RESERVOIR)
    start = [field.copy() for field in valves.state]
    switches = rng.random((PERIODS, N)) < 0.08
    inputs = Inputs(
        U=np.where(np.cumsum(switches, axis=0) % 2 == 0, 24.0, 0.0),
        sigma_S=rng.uniform(0, 3e-3, (PERIODS, N)),
        p1_slope=np.zeros((PERIODS, N)),
        refill=rng.uniform(0, 4e-3, (PERIODS, N)),
    )
    later = valves.record(inputs, PERIOD)
    states = State(*(np.vstack([a, b]) for a, b in zip(start, later, strict=True)))
    return p, states, inputs


def mass(pressure, volume, p):
    """Air in a chamber relative to the start [kg]."""
    return (pressure - pressure[0]) * volume / (p["R_gas"] * p["T_env"])


def total(flow):
    """Air moved by a flow that is constant over each period, at the borders of the periods [kg]."""
    return np.vstack([np.zeros(N), np.cumsum(flow, axis=0)]) * PERIOD


def test_every_chamber_holds_what_came_in_less_what_went_out():
    """Circuit, control chamber and reservoir; much happens in the run."""
    p, q, u = switched_at_random()
    consumed, refilled = total(u.sigma_S), total(u.refill)
    np.testing.assert_allclose(mass(q.p2, p["V2"], p), q.air_in_PV - consumed, rtol=0, atol=1e-14)
    np.testing.assert_allclose(mass(q.p3, p["V3"], p), q.air_in_MV - q.air_vented, rtol=0, atol=1e-16)
    drawn = q.air_in_PV + q.air_in_MV
    np.testing.assert_allclose(mass(q.p1, RESERVOIR, p), refilled - drawn, rtol=0, atol=1e-13)
    assert np.max(q.air_in_PV) > 1e-3
    assert np.max(q.air_vented) > 1e-4
    assert np.min(q.p1) < 11.9e5


@pytest.mark.parametrize("restitution", [0.0, 0.7])
def test_movers_stay_between_their_stops(restitution):
    p, q, _ = switched_at_random(restitution)
    for x, limit in ((q.xPV, p["xPVmax"]), (q.xMV, p["xMVmax"])):
        assert np.min(x) == 0.0
        assert np.max(x) == limit


def test_coil_energy_is_the_integral_of_electrical_power():
    fine = 50e-6
    start = energised(CALIBRATED, p1=12e5, p2=6e5, U=0.0)._replace(xMV=0.0, p3=1e5)
    valves = Valves.started(1, CALIBRATED, start)
    U = np.full((400, 1), 24.0)
    q = valves.record(Inputs(U, *np.zeros((3, 1, 1))), fine)
    power = 24.0 * np.append(start.I, q.I)
    assert q.coil_energy[-1, 0] == pytest.approx(simpson(power, dx=fine), rel=1e-6)


def test_nothing_moves_when_nothing_acts():
    """Vented, shut and without a supply pressure: a valve with everything off stays as it is."""
    valves = Valves(3)
    for field in (valves.state.p1, valves.state.p2, valves.state.p3):
        field[:] = CALIBRATED["p_env"]
    before = np.array(valves.state)
    valves.advance(1.0)
    np.testing.assert_array_equal(np.array(valves.state), before)
