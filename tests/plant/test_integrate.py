"""The batched integrator against SciPy with every event at a border of its own, and runs of others."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from epv_env.common.units import BAR, MILLIMETRE
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import Inputs
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised, simulate
from tests.reference.hybrid_automaton import COMPILED_RIGHT_HAND_SIDES, POSITIONS
from tests.reference.reference_simulation import ReferenceRun, simulate_reference
from tests.reference.schedule import (
    Schedule,
    away_from_events,
    largest_difference,
    piecewise_schedule,
    plant_states,
    report_tests,
    sample_times,
)

MILLIBAR = 100.0  # Pa
MILLIAMPERE = 1e-3
NEAR_STOP = 0.2e-3  # s
EVENT_TIME = 0.1e-3  # s

CALIBRATED = Parameters.calibrated()
REPORT = report_tests(CALIBRATED)


@cache
def reference(name: str) -> ReferenceRun:
    """Reference run of a test of the report, sampled every 0.5 ms."""
    return simulate_reference(REPORT[name], sample_times(REPORT[name], 0.5e-3))


def assert_agrees(schedule: Schedule, run: ReferenceRun, within: float = 1.0) -> None:
    """The plant at its default step meets the bars, in units of `within`."""
    found = plant_states(schedule, run.time)
    everywhere = np.full(run.time.shape, True)
    calm = away_from_events(run, NEAR_STOP, "lands")
    assert largest_difference(found.p2, run.state.p2, everywhere) < within * MILLIBAR
    assert largest_difference(found.p3, run.state.p3, everywhere) < within * MILLIBAR
    assert largest_difference(found.I, run.state.I, calm) < within * 0.5 * MILLIAMPERE


@pytest.mark.parametrize("name", REPORT)
def test_agrees_with_scipy_on_the_report_s_tests(name):
    assert_agrees(REPORT[name], reference(name), within=0.1)


@pytest.mark.parametrize("name", ["test4", "validation"])
def test_two_references_agree(name):
    """LSODA and DOP853 share nothing but the right-hand side and the automaton."""
    other = simulate_reference(REPORT[name], reference(name).time, method="DOP853", rtol=1e-11)
    assert np.max(np.abs(other.state.p2 - reference(name).state.p2)) < 1e-3 * MILLIBAR
    assert [e.name for e in other.events] == [e.name for e in reference(name).events]


@pytest.mark.parametrize("name", REPORT)
def test_events_happen_when_scipy_finds_them(name):
    schedule, events = REPORT[name], reference(name).events
    at = np.array([event.time for event in events])
    before = plant_states(schedule, at - EVENT_TIME)
    after = plant_states(schedule, at + EVENT_TIME)
    strokes = {"piston": ("xPV", "xPVmax"), "armature": ("xMV", "xMVmax")}
    for k, event in enumerate(events):
        mover, what, where = event.name.split()[:3]
        stroke, limit = strokes[mover]
        x = getattr(before, stroke)[k], getattr(after, stroke)[k]
        stop = 0.0 if where == "low" else schedule.parameters[limit]
        if what == "lands":
            assert x[0] != stop, event
            assert x[1] == stop, event
        elif what == "leaves":
            assert x[0] == stop, event
            assert x[1] != stop, event
        else:  # passes a kink in between
            kink = schedule.parameters["dMVin"] / 4
            if where == "exhaust":
                kink = schedule.parameters["xMVmax"] - schedule.parameters["dMVexh"] / 4
            assert (x[0] - kink) * (x[1] - kink) < 0, event


def random_schedule(seed: int) -> Schedule:
    """A valve within 5 % of Table 12's, whose coil, consumption and supply change at random for 1 s."""
    rng, periods = np.random.default_rng(seed), 200
    symbols = ("alphaMV", "alphaPV", "RML", "R", "V3", "cPV", "mMV", "kMV", "dMVin")
    restitution = rng.choice([0.0, 0.5])
    changes = {symbol: CALIBRATED[symbol] * rng.uniform(0.95, 1.05) for symbol in symbols}
    p = CALIBRATED.replace(**changes, eMV=restitution, ePV=restitution)
    off = np.cumsum(rng.random(periods) < 0.15) % 2 == 1
    consumed = np.repeat(rng.uniform(-4e-3, 4e-3, 4).clip(0.0), periods // 4)
    slope = rng.uniform(-2e6, 2e6, periods) * (rng.random(periods) < 0.05)
    start = energised(p, p1=rng.uniform(9e5, 13e5), p2=6.5e5, U=24.0)
    borders = 5e-3 * np.arange(periods + 1)
    return piecewise_schedule(
        p, start, borders, U=np.where(off, 0.0, 24.0), sigma_S=consumed, p1_slope=slope
    )


@pytest.mark.parametrize("seed", range(8))
def test_agrees_with_scipy_under_random_switching(seed):
    schedule = random_schedule(seed)
    run = simulate_reference(schedule, sample_times(schedule, 1e-3))
    assert np.ptp(run.state.p2) > 0.2e5
    assert_agrees(schedule, run, within=0.1)


def test_a_bounce_within_one_step_is_not_missed():
    """Switched off on its way up, the armature touches the stop for less than a step and falls."""
    at_rest = REPORT["test1"].initial._replace(xMV=0.0, I=0.0, p2=8e5, p3=10e5)
    p = CALIBRATED.replace(eMV=0.3)
    schedule = piecewise_schedule(p, at_rest, [0.0, 4.67e-3, 10.67e-3], U=[24.0, 0.0])
    assert_agrees(schedule, simulate_reference(schedule, sample_times(schedule, 1e-4)))


def test_a_rebound_takes_the_time_of_flight_of_a_thrown_body():
    """Under a constant force F, a mover that leaves a stop at v is back after 2 m v / F."""
    p = CALIBRATED.replace(eMV=0.95, kMV=0.0)
    falling = REPORT["test4"].initial._replace(xMV=2e-5, vMV=-0.02, I=0.0)
    schedule = piecewise_schedule(p, falling, [0.0, 5e-3], U=0.0)
    landings = [e.time for e in simulate_reference(schedule, [0.0]).events if "lands" in e.name]
    times = np.array(landings[:3])
    after = plant_states(schedule, times + 1e-6)
    assert np.all(after.vMV > 0)
    flight = 2 * p["mMV"] * after.vMV[:2] / (p["cMV"] * p["xMV0"])  # spring force nearly constant
    np.testing.assert_allclose(np.diff(times), flight, rtol=0.02)
    np.testing.assert_allclose(after.vMV[1:] / after.vMV[:-1], 0.95, rtol=0.01)


def opening_away_from_the_laminar_seam():
    """One opening whose p3 stays off p1 and so misses the laminar seam, which no event marks."""
    energised = REPORT["test1"].initial
    return piecewise_schedule(
        CALIBRATED, energised._replace(p3=0.95 * energised.p1), [0.0, 0.09, 0.12], U=[0.0, 24.0]
    )


def errors(schedule: Schedule, steps, period: float = 0.5e-3) -> dict[str, list[float]]:
    """Largest error of each measured state for each step, against the reference at rtol 1e-11."""
    run = simulate_reference(schedule, sample_times(schedule, period), rtol=1e-11)
    found = [plant_states(schedule, run.time, step=step) for step in steps]
    return {
        field: [np.max(np.abs(getattr(q, field) - getattr(run.state, field))) for q in found]
        for field in ("p2", "p3", "I")
    }


@pytest.mark.parametrize("field", ["p2", "p3", "I"])
def test_error_falls_with_the_fourth_power_of_the_step(field):
    steps = [1e-3, 500e-6, 250e-6, 125e-6]
    error = errors(opening_away_from_the_laminar_seam(), steps)[field]
    assert np.polyfit(np.log(steps), np.log(error), 1)[0] >= 3.5


def test_an_integrator_without_stop_events_is_wrong():
    """SciPy's LSODA sees the movers held at their stops, but is not told when they meet them."""
    schedule = REPORT["test4"]
    p, u, y = schedule.parameters, np.zeros(len(Inputs._fields)), np.array(schedule.initial, dtype=float)
    c, e = coefficients(p), effect_constants(p)
    limits = dict(zip(POSITIONS, (p["xPVmax"], p["xMVmax"]), strict=True))

    def rates(_, y):
        inside = np.array(y)
        for x, limit in limits.items():
            inside[x] = min(max(y[x], 0.0), limit)
        return COMPILED_RIGHT_HAND_SIDES[False](inside, u, c, e, 1.0, 1.0)[:-2]

    for k, ends in enumerate(pairwise(schedule.borders)):
        u[:] = [field[k] for field in schedule.inputs]
        y = solve_ivp(rates, ends, y, method="LSODA", rtol=1e-6, atol=1e-9).y[:, -1]
    assert abs(y[0] - reference("test4").state.p2[-1]) > 100 * MILLIBAR


@pytest.mark.parametrize("change", ["step 8 times as large", "alphaMV 1 % larger"])
def test_this_comparison_can_fail(change):
    schedule, run = REPORT["test1"], reference("test1")
    p = schedule.parameters
    if change.startswith("step"):
        found = plant_states(schedule, run.time, step=2e-3)
    else:
        other = report_tests(p.replace(alphaMV=1.01 * p["alphaMV"]))["test1"]
        found = plant_states(other, run.time)
    assert np.max(np.abs(found.p2 - run.state.p2)) > MILLIBAR


SHARED = Path(__file__).parents[3] / "shared" / "reference"
RUNS = ("test1", "test2", "test3", "test4", "validation", "consumption")


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"the reference runs are not at {SHARED}")
@pytest.mark.parametrize("name", RUNS)
def test_agrees_with_another_implementation(name):
    run = np.genfromtxt(SHARED / f"{name}.csv", delimiter=",", names=True)
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
