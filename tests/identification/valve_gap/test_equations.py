"""Forcings on the valve's state equations, and its regimes."""

from functools import cache

import numpy as np
import pytest

from epv_env.plant.equations import Inputs, State
from identification.gap.plant import StateEquation, window_forcing
from identification.replay.equations import EQUATIONS, FORCINGS
from identification.valve_gap.valve import Valve
from tests.identification.valve_gap.campaigns import campaign

BY_NAME = {equation.name: equation for equation in EQUATIONS}


@cache
def valve() -> Valve:
    return Valve(campaign("test1", "validation", "rest"))


def values() -> dict[str, np.ndarray]:
    return {"R": np.array([valve().base["R"]])}


def forced(equation: StateEquation, edges: np.ndarray) -> np.ndarray:
    """Changes (3, samples, windows) in the first run."""
    samples = len(valve().runs[0].time)
    return valve().forced(values(), 0, window_forcing(equation, samples, edges))


def test_the_seven_equations_are_those_of_the_report_s_states():
    assert [equation.state for equation in EQUATIONS] == list(State._fields[:7])
    assert {equation.name for equation in EQUATIONS if equation.step} == set(FORCINGS)
    assert all(name in Inputs._fields for name, _, _ in FORCINGS.values())
    assert [e.name for e in EQUATIONS if not e.step] == ["f3", "f5"]  # x' = v lacks nothing


def test_air_forced_into_the_shut_circuit_stays_there():
    """Isothermal chamber: its pressure rises by R T m / V2, and nothing else moves."""
    p, equation = valve().base, BY_NAME["f1"]
    change = forced(equation, np.array([10, 30]))[:, :, 0]
    mass = equation.step * 20 * valve().runs[0].time[1]
    rise = p["R_gas"] * p["T_env"] * mass / p["V2"]
    np.testing.assert_allclose(change[0, 30:60], rise, rtol=1e-6)
    np.testing.assert_allclose(change[:, :11], 0.0, atol=1e-9)
    np.testing.assert_allclose(change[1:, :60], 0.0, atol=1e-6)


def test_a_voltage_raises_the_current_of_a_held_coil_by_ohm_s_law():
    equation = BY_NAME["f7"]
    change = forced(equation, np.array([0, 75]))[:, :, 0]
    assert change[2, 75] == pytest.approx(equation.step / valve().base["R"], rel=0.02)


@pytest.mark.parametrize("name", ["f4", "f6"])
def test_a_small_force_moves_nothing_that_a_stop_holds(name):
    change = forced(BY_NAME[name], np.array([0, 50]))
    noise = [[[channel.noise]] for channel in valve().channels]
    assert np.max(np.abs(change / noise)) < 1e-3


@pytest.mark.parametrize("name", FORCINGS)
def test_responses_to_windows_add_up_to_that_to_their_union(name):
    edges = np.array([0, 200, 230, 300, 400])
    each = forced(BY_NAME[name], edges)
    whole = forced(BY_NAME[name], edges[[0, -1]])[:, :, 0]
    size = np.max(np.abs(whole), axis=1, keepdims=True)
    noise = np.array([[channel.noise] for channel in valve().channels])
    assert np.all(np.abs(np.sum(each, axis=2) - whole) < 0.05 * size + 0.02 * noise)


def test_regimes_cover_every_sample_and_go_with_the_voltage():
    for r, recording in enumerate(valve().recordings):
        found = valve().regimes(values(), r)
        assert np.all(np.any(list(found.values()), axis=0))
        assert all(np.any(mask) for mask in found.values())
        assert not np.any(found["coil_rise"] & ~recording.energised)
        assert not np.any(found["coil_decay"] & recording.energised)
        assert not np.any(found["filling"] & found["venting"])
        assert np.all(found["shut"][:50])  # the hold


def test_regimes_follow_one_another_as_the_valve_works():
    found = valve().regimes(values(), 0)
    first = {name: int(np.argmax(mask)) for name, mask in found.items()}
    order = ["shut", "coil_decay", "venting", "pv_opening", "pv_open", "coil_rise", "filling"]
    begins = [first[name] for name in order]
    assert begins == sorted(begins)
    assert first["filling"] < first["pv_shutting"]
