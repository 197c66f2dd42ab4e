"""The pulse table answers as a simulation of the same pulse does, forwards and backwards."""

import numpy as np
import pytest

from controllers import pulse_table as lookup
from controllers.pulse_table import STAY, opening_pressure, pulse_table
from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

pytestmark = pytest.mark.training
CLOSE = 0.03
"""What interpolating between the table's nodes may cost, on pulses of up to 0.6 bar [bar]."""


@pytest.fixture(scope="module")
def plant():
    return Parameters.calibrated()


@pytest.fixture(scope="module")
def table(plant):
    return pulse_table(plant)


@pytest.fixture(scope="module")
def cases():
    """p1, p2, p3 between the table's nodes, p3 down to near where the valve opens [bar]."""
    rng = np.random.default_rng(5)
    p1, p2 = rng.uniform(10.5, 12.5, 200), rng.uniform(5.5, 9.3, 200)
    p3 = p1 * rng.uniform(0.75, 1.0, 200)
    return p1, p2, p3


def gained(table, t, offset, p1, p2, p3, stay, slope):
    """Change of p2 until the valve has shut, if the coil stays off for `stay` [s] [bar]."""
    age = lookup.venting_age(table, t, offset, p1, p2, p3)
    node, share = lookup.place(STAY, stay + min(age, 0.0))
    at = (table, t, lookup.cell_of(p1, p2, age), age, slope)
    return lookup.change(*at, node) * (1 - share) + lookup.change(*at, node + 1) * share


def each(name, table, *arguments):
    """A lookup of the table's one plant, for many valves: numbers or arrays (n,)."""
    function = gained if name == "gained" else getattr(lookup, name)
    return np.array([function(table, 0, 0.0, *numbers) for numbers in np.broadcast(*arguments)])


def pulsed(plant, p1, p2, p3, stay, *, at_rest=False):
    """p2 added by a real pulse from an armature that has let go, or from rest with p3 = p1."""
    start = energised(plant, p1=p1 * BAR, p2=p2 * BAR, U=24.0)
    if not at_rest:
        start = start._replace(p3=p3 * BAR, xMV=0.0, I=0.0, I_coil=0.0)
    valves = Valves.started(len(p1), plant, start, threads=1)
    valves.advance(stay)
    valves.inputs.U[:] = 24.0
    valves.advance(60e-3)
    assert not np.any(valves.state.xPV)
    return valves.state.p2 / BAR - p2


def test_gains_between_the_nodes_are_those_of_the_simulation(plant, table, cases):
    p1, p2, p3 = cases
    stay = each("time_to_open", table, p1, p2, p3) + np.linspace(-5e-3, 15e-3, len(p1))
    added = pulsed(plant, p1, p2, p3, stay)
    small = added < 0.6
    assert np.sum(small) > 100
    error = np.abs(each("gained", table, p1, p2, p3, stay, 0.0) - added)
    assert np.max(error[small]) < CLOSE
    assert np.max(error / np.maximum(added, 0.6)) < 0.05


def test_a_pulse_from_rest_adds_what_was_asked(plant, table, cases):
    p1, p2, _ = cases
    asked = np.linspace(0.02, 0.6, len(p1))
    duration = each("duration", table, p1, p2, p1, asked, 0.0) + table.release_lag[0]
    assert np.max(np.abs(pulsed(plant, p1, p2, p1, duration, at_rest=True) - asked)) < CLOSE


def test_a_pulse_begun_before_p3_has_recovered_adds_what_was_asked(plant, table, cases):
    p1, p2, p3 = cases
    asked = np.linspace(0.02, 0.6, len(p1))
    added = pulsed(plant, p1, p2, p3, each("duration", table, p1, p2, p3, asked, 0.0))
    assert np.max(np.abs(added - asked)) < CLOSE


def test_the_check_can_fail_a_pulse_planned_for_another_valve_misses(plant, cases):
    other = pulse_table(plant.replace(alphaMV=1.1 * plant["alphaMV"]))
    p1, p2, p3 = cases
    asked = np.full(len(p1), 0.3)
    added = pulsed(plant, p1, p2, p3, each("duration", other, p1, p2, p3, asked, 0.0))
    assert np.mean(np.abs(added - asked)) > 3 * CLOSE


def test_consumption_during_a_pulse_is_allowed_for(table, cases):
    """With a slope the change of p2 is meant, without one the gain: they differ by what is consumed."""
    p1, p2, p3 = cases
    stay = each("time_to_open", table, p1, p2, p3) + 8e-3
    fall = each("gained", table, p1, p2, p3, stay, -2.0) - each("gained", table, p1, p2, p3, stay, 0.0)
    assert np.all(fall < -2.0 * stay)
    assert np.all(fall > -2.0 * (stay + 60e-3))
    longer = each("duration", table, p1, p2, p3, np.full(len(p1), 0.1), -2.0)
    assert np.all(longer > each("duration", table, p1, p2, p3, np.full(len(p1), 0.1), 0.0))
    back = each("gained", table, p1, p2, p3, longer, -2.0)
    assert back == pytest.approx(0.1, abs=1e-9)


def test_what_is_under_way_is_the_gain_without_a_stay_to_the_bit(table, cases):
    p1, p2, p3 = cases
    p3 = p3 * np.linspace(0.2, 1.0, len(p3))
    at_once = each("gained_at_once", table, p1, p2, p3)
    assert np.ptp(at_once) > 0.1
    assert np.array_equal(at_once, each("gained", table, p1, p2, p3, np.zeros(len(p1)), 0.0))


def test_p3_vents_at_one_rate_until_the_valve_opens(plant, table):
    """The axis of the table: ln p3 falls linearly, so the opening pressure is met when foretold."""
    p1, p2 = np.array([11.0]), np.array([7.0])
    opening = opening_pressure(plant, p1 * BAR, p2 * BAR)
    start = energised(plant, p1=p1 * BAR, p2=p2 * BAR, U=24.0)
    valves = Valves.started(1, plant, start, threads=1)
    valves.advance(float(each("time_to_open", table, p1, p2, p1)[0]) + table.release_lag[0])
    assert valves.state.p3 == pytest.approx(opening, rel=1e-3)


def test_an_empty_chamber_is_seen_to_shut_late(plant, table):
    """A valve that begins wide open over an empty chamber: first filling, and after a long release."""
    p1, p2 = np.array([10.5, 11.5, 12.5]), np.array([3.5, 4.5, 6.0])
    start = energised(plant, p1=p1 * BAR, p2=p2 * BAR, U=24.0)
    empty = start._replace(
        p3=np.full(3, plant["p_env"]), xPV=np.full(3, plant["xPVmax"]), xMV=0.0, I=0.0, I_coil=0.0
    )
    valves = Valves.started(3, plant, empty, threads=1)
    valves.inputs.U[:] = 24.0
    valves.advance(150e-3)
    assert not np.any(valves.state.xPV)
    p3 = np.full(3, plant["p_env"] / BAR)
    foreseen = each("gained", table, p1, p2, p3, np.zeros(3), 0.0)
    np.testing.assert_allclose(foreseen, valves.state.p2 / BAR - p2, rtol=0.05)
    assert np.all(foreseen > 1.3 * each("gained", table, p1, p2, np.full(3, 3.0), np.zeros(3), 0.0))


def test_a_chamber_vents_in_the_time_foretold(plant, table):
    """Down to subcritical pressures, where ln p3 falls more slowly."""
    p1, p2 = np.array([11.0]), np.array([7.0])
    start = energised(plant, p1=p1 * BAR, p2=p2 * BAR, U=24.0)
    valves = Valves.started(1, {**plant, "V2": 1e9 * plant["V2"]}, start, threads=1)
    seen = []
    for _ in range(30):
        valves.advance(10e-3)
        seen.append(float(each("venting_age", table, p1, p2, valves.state.p3 / BAR)[0]))
    assert valves.state.p3 < 1.3 * BAR
    np.testing.assert_allclose(np.diff(seen[2:]), 10e-3, rtol=0.02)


def test_a_coil_too_weak_to_shut_the_valve_is_refused(plant):
    with pytest.raises(ValueError, match="a pulse cannot be planned"):
        pulse_table(plant, supply_voltage=3.0)
