"""The observation is a float32 contract of measured, normalised, noisy readings and nothing else."""

from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from epv_env.observation import (
    ENTRIES,
    HISTORY,
    INDEX,
    LAYOUT,
    P2_LAGS,
    P3_LAGS,
    READINGS,
    decode,
    encode,
    observation_space,
    read,
    write,
)
from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import table
from tests.env.rollouts import actions, native, run

MEASURED = ("p1", "p3", "I")
STEADY = {"supply": 9.0, "target_bar": 7.0, "p2_bar": 7.0, "scenario": "none"}


def readings(name, *, periods=200, n=64, **options):
    """Decoded readings with the coil on throughout, (periods, n)."""
    commands = np.ones((periods, n), dtype=np.int64)
    found = run(native("EPValve-v0", n, **STEADY, **options), commands)
    return decode(np.array([step.observation for step in found.steps]), name).astype(float)


def test_the_layout_names_measured_quantities_only():
    assert [quantity.name for quantity in LAYOUT] == [
        "p2_error", "target", "p1", "p3", "I", "action", "since_switching",
        "p2_change_1", "p2_change_2", "p2_change_4", "p2_change_8", "p3_change_1", "p3_change_4",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("identifier", "supply", "target"),
    [("EPValve-v0", (2.0, 16.0), 2.0), ("EPValvePWM-v0", 16.0, (2.0, 16.0))],
    ids=str,
)
def test_observations_stay_in_their_space_under_extremes(identifier, supply, target):
    env = native(
        identifier, 16, autoreset_mode=AutoresetMode.SAME_STEP, max_episode_steps=150,
        parameters="domain", supply=supply, target_bar=target, p2_bar=(1.51, 16.0),
        p3_bar=(1.0, 16.0),
    )  # fmt: skip
    found = run(env, actions(identifier, 16, 600))
    seen = np.array([step.observation for step in found.steps])
    space = observation_space()
    assert seen.dtype == np.float32
    assert np.all((seen >= space.low) & (seen <= space.high))
    assert np.all(np.isfinite([step.reward for step in found.steps]))


def test_plants_at_random_corners_of_all_domains_are_integrated():
    """An episode that ends above 1.5 bar was given up."""
    n, rng = 16, np.random.default_rng(1)
    varied = {symbol: row.domain for symbol, row in table().items() if row.domain}
    corners = [{symbol: float(rng.choice(ends)) for symbol, ends in varied.items()} for _ in range(n)]
    env = native("EPValve-v0", n, supply=16.0, target_bar=(2.0, 16.0), p2_bar=(2.0, 16.0))
    env.reset(seed=0, options={"parameters": corners, "p3_bar": (1.0, 16.0)})
    for command in actions("EPValve-v0", n, 60):
        terminated = env.step(command)[2]
        assert np.all(env.task.valves.state.p2[terminated] <= 1.5e5)


@pytest.mark.parametrize("parameters", ["exact", {"a2": 2e-4}], ids=str)
def test_a_valve_that_cannot_be_integrated_ends_its_episode_with_finite_figures(parameters):
    env = native("EPValve-v0", 2)
    env.reset(seed=0, options={"parameters": parameters})
    env.task.valves.tables.coefficients[:, 0] = np.nan
    observation, reward, terminated, _, infos = env.step(np.array([1, 1]))
    np.testing.assert_array_equal(terminated, [True, False])
    assert env.observation_space.contains(observation)
    assert np.all(np.isfinite(reward))
    assert infos["reward_failure"][0] < 0
    assert all(np.all(np.isfinite(values)) for values in infos.values())


@pytest.mark.parametrize(("name", "factor"), [("p1", 1.0), ("p3", 4.0), ("I", 1.0)])
def test_noise_is_table_3_s(name, factor):
    """Noise before rounding: the variances of both add up."""
    sensor = SENSORS[name]
    seen = readings(name, sensor_noise=factor)
    expected = np.hypot(factor * sensor.noise, sensor.resolution / np.sqrt(12))
    assert np.std(seen) == pytest.approx(expected, rel=0.05)
    assert np.ptp(readings(name, sensor_noise=False)) < 1e-6
    assert np.mean(seen) == pytest.approx(
        np.mean(readings(name, sensor_noise=False)), abs=0.6 * sensor.resolution
    )


def test_noise_is_white_and_of_its_own_in_every_channel_and_environment():
    series = np.stack([readings(name) for name in ("p2_error", *MEASURED)])
    series -= series.mean()
    shifted = {
        "next sample": (series[:, 1:], series[:, :-1]),
        "next environment": (series[..., 1:], series[..., :-1]),
        "next channel": (series[1:], series[:-1]),
    }
    series -= series.mean(axis=(1, 2), keepdims=True)
    for what, (a, b) in shifted.items():
        assert abs(np.mean(a * b)) < 0.03 * np.std(a) * np.std(b), what


def test_changes_are_differences_of_past_readings():
    found = run(native("EPValve-v0", 3), actions("EPValve-v0", 3, 30))
    seen = np.array([found.first, *(step.observation for step in found.steps)])
    error = decode(seen, "p2_error")
    for lag in P2_LAGS:
        earlier = np.concatenate([np.repeat(error[:1], lag, axis=0), error[:-lag]])
        np.testing.assert_allclose(decode(seen, f"p2_change_{lag}"), error - earlier, atol=1e-5)


def test_action_and_time_since_switching_are_told():
    commands = np.array([1, 0, 0, 0, 1, 1] + 50 * [1])[:, None]
    seen = np.array([s.observation for s in run(native("EPValve-v0", 1), commands).steps])
    np.testing.assert_array_equal(decode(seen, "action"), commands)
    waited = decode(seen, "since_switching")[:, 0]
    np.testing.assert_allclose(waited[:6], [0.2, 5e-3, 10e-3, 15e-3, 5e-3, 10e-3], atol=1e-7)
    assert waited[-1] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("periods", "other"),
    [
        (20, {"parameters": {"V2": 4e-4, "alphaPV": 0.4, "mPV": 0.015, "xPVmax": 0.001}}),
        (100, {"scenario": "emergency"}),  # no application starts in the first half second
    ],
)
def test_what_a_valve_is_made_of_and_what_is_to_come_is_not_observed(periods, other):
    """Episodes that differ in that alone look the same as long as nothing moves."""
    commands = np.ones((periods, 2), dtype=np.int64)
    seen = [run(native("EPValve-v0", 2, **STEADY | own), commands) for own in ({}, other)]
    for a, b in zip(seen[0].steps, seen[1].steps, strict=True):
        np.testing.assert_array_equal(a.observation, b.observation)


@pytest.mark.parametrize("name", ["p2_error", "p1", "action"])
def test_decode_undoes_encode(name):
    row = LAYOUT[INDEX[name]]
    values = row.centre + row.scale * np.linspace(-row.limit, row.limit, 101)
    columns = {other: np.full(101, LAYOUT[INDEX[other]].centre) for other in INDEX}
    observations = encode({**columns, name: values})
    assert observations.dtype == np.float32
    np.testing.assert_allclose(
        decode(observations, name), values, rtol=3e-7, atol=3e-7 * row.scale * row.limit
    )
    others = np.delete(observations, INDEX[name], axis=1)
    np.testing.assert_array_equal(others, 0.0)


def test_a_record_of_readings_is_the_observation_in_its_units_and_is_written_as_it_was_read() -> None:
    seen = np.random.default_rng(0).uniform(-0.5, 0.5, ENTRIES).astype(np.float32)
    r = np.zeros(1, READINGS)[0]
    read(r, seen)
    names = ("p2_error", "target", "p1", "p3", "I", "action", "since_switching")
    fields = ("error", "target", "p1", "p3", "current", "coil", "waited")
    assert [r[field] for field in fields] == pytest.approx([decode(seen, name) for name in names])
    assert r.p2 == r.error + r.target
    past = SimpleNamespace(p2_history=np.full(HISTORY, r.p2), p3_history=np.full(HISTORY, r.p3))
    past.p2_history[list(P2_LAGS)] -= r.p2_change
    past.p3_history[list(P3_LAGS)] -= r.p3_change
    again = np.zeros(ENTRIES)
    write(again, past, r.p1, r.current, r.target, r.coil, r.waited)
    np.testing.assert_allclose(again, seen, rtol=0, atol=1e-6)
