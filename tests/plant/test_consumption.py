"""Consumption is the exact mean of trapezoids in time, drawn within a scenario's ranges."""

import numpy as np
import pytest

from epv_env.plant.consumption import (
    APPLICATIONS,
    GRAM,
    SCENARIOS,
    Profile,
    Profiles,
    check_scenario,
    draw_profile,
)

LONGEST_PERIOD = 0.1
"""Of control [s] (`settings`); the reader sees two applications in one period at most."""


def profile(*, leak=0.0, start=0.1, rise=0.0, hold=0.0, fall=0.0, flow=0.0, pause=1.0):
    """A profile of equal applications [s, kg/s]."""
    length = rise + hold + fall + pause
    starts = start + length * np.arange(APPLICATIONS)
    rows = [np.broadcast_to(x, APPLICATIONS) for x in (starts, rise, hold, fall, flow)]
    return Profile(leak=leak, applications=np.stack(rows), span=length * APPLICATIONS)


def flows(profiles, period, duration):
    """Mean flow of each period [kg/s], (periods, n)."""
    reader = Profiles(len(profiles))
    for i, one in enumerate(profiles):
        reader.start(i, one)
    n = len(profiles)
    return np.array(
        [reader.mean_flow(np.full(n, k * period), period) for k in range(round(duration / period))]
    )


def drawn(name, n, seed=0):
    """n profiles of a scenario."""
    return [draw_profile(name, np.random.default_rng((seed, i))) for i in range(n)]


@pytest.mark.parametrize("period", [5e-3, 7e-3])
def test_the_air_taken_is_the_area_of_the_trapezoids(period):
    one = profile(leak=1e-4, rise=0.03, hold=0.05, fall=0.02, flow=4e-3, pause=0.2)
    duration = 2.94  # of whole periods, each of these four; ends in the pause after ten applications
    taken = np.sum(flows([one], period, duration)) * period
    area = 4e-3 * (0.03 / 2 + 0.05 + 0.02 / 2)
    assert taken == pytest.approx(1e-4 * duration + 10 * area, rel=1e-11)


@pytest.mark.parametrize("name", ["service", "pumping", "creeping"])
def test_a_long_period_is_the_mean_of_its_parts(name):
    profiles = drawn(name, 8)
    fine = flows(profiles, 5e-3, 4.8)
    for period in (20e-3, LONGEST_PERIOD):
        parts = fine.reshape(-1, round(period / 5e-3), 8).mean(axis=1)
        np.testing.assert_allclose(flows(profiles, period, 4.8), parts, atol=1e-13)


@pytest.mark.parametrize("name", SCENARIOS)
def test_draws_lie_within_the_stated_ranges_and_fill_them(name):
    scenario = SCENARIOS[name]
    profiles = drawn(name, 64)
    start, *rest = np.stack([one.applications for one in profiles], axis=1)
    for row, unit, field in zip(rest, (1, 1, 1, GRAM), ("rise", "hold", "fall", "flow"), strict=True):
        low, high = getattr(scenario, field)
        assert low * unit <= np.min(row) <= np.max(row) <= high * unit
        assert np.ptp(row) >= 0.99 * unit * (high - low)
    rise, hold, fall, _ = rest
    pause = start[:, 1:] - (start + rise + hold + fall)[:, :-1]
    assert np.min(pause) >= scenario.pause[0] - 1e-9
    assert np.max(pause) <= scenario.pause[1] + 1e-9
    assert np.all((start[:, 0] >= scenario.first[0]) & (start[:, 0] <= scenario.first[1]))
    leaks = np.array([one.leak for one in profiles]) / GRAM
    assert np.all((leaks >= scenario.leak[0]) & (leaks <= scenario.leak[1]))


def test_the_drawn_sequence_wraps_with_a_pause_between():
    one = draw_profile("pumping", np.random.default_rng(3))
    found = flows([one], 20e-3, 2.2 * one.span)[:, 0]
    end = one.applications[0, 0] + 2 * one.span - 0.04  # within the pause after the second round
    taken = np.sum(found[: round(end / 20e-3)]) * 20e-3
    _, rise, hold, fall, flow = one.applications
    assert taken == pytest.approx(2 * np.sum(flow * (rise / 2 + hold + fall / 2)), rel=1e-9)


def test_episodes_are_read_independently():
    """A new episode begins at its own time 0, and the others go on."""
    one = profile(start=0.02, hold=0.03, flow=1e-3, pause=0.07)
    reader = Profiles(2)
    reader.start(0, one)
    reader.start(1, one)
    alone = flows([one], 0.01, 0.3)[:, 0]
    for k in range(20):
        if k == 8:
            reader.start(1, one)
        time = np.array([k, k if k < 8 else k - 8]) * 0.01
        np.testing.assert_array_equal(reader.mean_flow(time, 0.01), alone[[k, k if k < 8 else k - 8]])


def test_an_unknown_name_is_refused():
    with pytest.raises(ValueError, match="unknown consumption scenario 'x': choose one of mixed, no"):
        check_scenario("x")
