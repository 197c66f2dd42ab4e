"""Plant, supply, disturbance and pressures can be set: for good at construction, or for one episode."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, save_plant
from epv_env.plant.region import Alternative, Mixture, Region
from epv_env.plant.supply import Supply
from tests.env.rollouts import IDS, actions, assert_same, native, run

CENTRE = Parameters.calibrated()
RECORDED = Supply.recorded(np.array([0.0, 0.1, 0.3]), np.array([9.0, 9.5, 8.0]))
MIXTURE = Mixture(
    alternatives=tuple(
        Alternative(name=str(sizes), probability=0.5, region=Region(centre=CENTRE).changed(sizes))
        for sizes in ({"t_delay": (0.002, 0.01)}, {"G_eddy": 0.004, "R": (40.0, 41.0)})
    )
)
CHOICES = [
    {"parameters": MIXTURE},
    {"parameters": {"alphaMV": 0.6}},
    {"parameters": {"alphaMV": (0.6, 0.7), "R": 41.0}},
    {"parameters": "ten_percent"},
    {"parameters": Parameters.nominal()},
    {"scenario": "leak"},
    {"supply": 9.5},
    {"supply": (9.5, 10.0)},
    {"supply": Supply.reservoirs((11.0, 11.5), 20.0)},
    {"supply": RECORDED, "target_bar": 7.0},
    {"target_bar": 7.0},
    {"target_bar": (6.0, 6.5)},
    {"p2_bar": (5.0, 6.0)},
    {"p3_bar": 3.0},
    {"conditions": {"vented": 1.0}},
    {"conditions": {"starved": 1.0}},
]


def valve(**options) -> Any:
    """One bare EPValve."""
    return gymnasium.make("EPValve-v0", **options).unwrapped


def episodes(env, n=200, options=None):
    """The valve's parameters in n episodes."""
    env.reset(seed=0, options=options)
    for _ in range(n):
        env.reset(options=options)
        yield env.task.parameters[0]


@pytest.mark.parametrize("identifier", IDS)
@pytest.mark.parametrize("options", CHOICES[::2], ids=str)
def test_an_option_means_the_same_at_construction_and_at_reset(identifier, options):
    commands = actions(identifier, 2, 30)
    built = run(native(identifier, 2, **options), commands)
    assert_same(run(native(identifier, 2), commands, options=options), built)
    with pytest.raises(AssertionError):  # and it means something
        assert_same(run(native(identifier, 2), commands), built)


@pytest.mark.parametrize("options", CHOICES[1::2], ids=str)
def test_reset_options_last_one_episode(options):
    env, plain = valve(), valve()
    env.reset(seed=0, options=options)
    plain.reset(seed=0)
    np.testing.assert_array_equal(env.reset()[0], plain.reset()[0])
    for action in (0, 0, 1):
        np.testing.assert_array_equal(env.step(action)[0], plain.step(action)[0])


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_an_autoreset_forgets_the_options(mode):
    limited = {"max_episode_steps": 3, "autoreset_mode": mode}
    env, plain = native("EPValve-v0", 2, **limited), native("EPValve-v0", 2, **limited)
    env.reset(seed=0, options={"target_bar": 15.0, "supply": 16.0})
    plain.reset(seed=0)
    off = np.zeros(2, dtype=int)
    seen, usual = ([one.step(off)[0] for _ in range(4)] for one in (env, plain))
    assert np.any(seen[0] != usual[0])
    np.testing.assert_array_equal(seen[-1], usual[-1])


def test_a_plant_file_is_the_centre_and_its_region_is_confidence(tmp_path):
    centre = Parameters.calibrated().replace(alphaMV=0.8)
    plant = Plant(parameters=centre, region=Region(centre=centre, boxes={"R": (40.0, 41.0)}))
    save_plant(plant, tmp_path / "plant.json")
    exact = next(episodes(valve(plant=tmp_path / "plant.json")))
    assert exact["alphaMV"] == 0.8
    drawn = list(episodes(valve(plant=str(tmp_path / "plant.json"), parameters="confidence"), 20))
    assert all(40.0 <= p["R"] <= 41.0 and p["alphaMV"] == 0.8 for p in drawn)


def test_diagnosis_draws_the_alternatives_of_the_plant_file_effects_included(tmp_path):
    region = MIXTURE.alternatives[0].region
    plant = Plant(parameters=CENTRE, region=region, diagnosis=MIXTURE)
    save_plant(plant, tmp_path / "plant.json")
    drawn = list(episodes(valve(plant=tmp_path / "plant.json", parameters="diagnosis")))
    late, eddy = ([p for p in drawn if p[symbol] > 0] for symbol in ("t_delay", "G_eddy"))
    assert 70 < len(late) < 130
    assert len(late) + len(eddy) == len(drawn)
    assert len({p["t_delay"] for p in late}) == len(late)
    assert all(p["G_eddy"] == 0.004 and 40.0 <= p["R"] <= 41.0 for p in eddy)


def test_a_recorded_supply_is_followed():
    env = valve(supply=RECORDED, target_bar=7.0)
    env.reset(seed=0)
    for k in range(1, 101):
        env.step(k % 3 // 2)
        expected = np.interp(5e-3 * k, [0.0, 0.1, 0.3], [9.0, 9.5, 8.0])
        assert env.snapshot().p1_bar == pytest.approx(expected, abs=1e-9)


def test_an_episode_begins_energised_and_not_above_its_target():
    env = valve()
    for seed in range(100):
        env.reset(seed=seed)
        start = env.snapshot()
        assert 6.0 <= start.target_bar <= 9.5
        assert start.target_bar - 2.0 <= start.p2_bar <= start.target_bar
        assert start.p3_bar == start.p1_bar
        assert (start.xMV_fraction, start.xPV_fraction) == (1.0, 0.0)


def test_lists_give_each_sub_environment_its_own():
    env = native("EPValve-v0", 3)
    env.reset(
        seed=0,
        options={
            "parameters": ["exact", {"R": 40.0}, {"R": (36.0, 37.0)}],
            "supply": [8.0, RECORDED, None],
            "scenario": ["none", "leak", "mixed"],
            "target_bar": [6.0, (7.0, 7.1), 8.0],
            "p2_bar": 5.0,
        },
    )
    parameters = [p["R"] for p in env.task.parameters]
    assert parameters[:2] == [Parameters.calibrated()["R"], 40.0]
    assert 36.0 <= parameters[2] <= 37.0
    np.testing.assert_allclose(env.task.valves.state.p1[:2], [8e5, 9e5])
    assert env.task.target[0] == 6.0
    assert 7.0 <= env.task.target[1] <= 7.1
    np.testing.assert_allclose(env.task.valves.state.p2, 5e5)
    infos = env.step(np.array([1, 1, 1]))[-1]
    assert infos["consumption_g_per_s"][0] == 0.0
    assert infos["consumption_g_per_s"][1] >= 0.1


def test_options_of_a_masked_reset_reach_the_masked_alone():
    env = native("EPValve-v0", 3, autoreset_mode="Disabled")
    before, _ = env.reset(seed=0)
    mask = np.array([False, True, False])
    after, _ = env.reset(seed=0, options={"reset_mask": mask, "target_bar": 5.0})
    assert env.task.target[1] == 5.0
    np.testing.assert_array_equal(after[~mask], before[~mask])
