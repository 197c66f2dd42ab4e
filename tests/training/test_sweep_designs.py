"""Designs cover what they promise and stay inside it; results add up."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pandas")
from controllers.hysteresis import Hysteresis
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters, sensitive_symbols, table
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import CALIBRATED_SYMBOLS, Region
from epv_env.settings import make_settings
from training.evaluation.effect_levels import LEVELS, effect_levels
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import SWEEP_SEED
from training.studies.episode_tasks import Batch, Study, condensed
from training.studies.parallel_run import Outcome
from training.studies.sweeps.episode_plan import TASK_EPISODES, Size, cells, chosen_points
from training.studies.sweeps.experiment_designs import ONE_AT_A_TIME, hypercube, parameters, regions
from training.studies.sweeps.parameter_space import Space
from training.studies.sweeps.result_tables import point_table
from training.studies.sweeps.worst_case_search import Effort

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()
SIZE = Size(episodes=4, joint_episodes=TASK_EPISODES + 8, effort=Effort(screened=8, generations=1))
EARLY = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="early")


def joint_region() -> Region:
    """A thin ellipsoid, as identification leaves."""
    p = Parameters.calibrated()
    deviation = 0.01 * np.array([p[s] for s in CALIBRATED_SYMBOLS])
    correlation = np.full((4, 4), 0.95) + 0.05 * np.eye(4)
    covariance = correlation * np.outer(deviation, deviation)
    return Region(centre=p, symbols=CALIBRATED_SYMBOLS, covariance=covariance, chi_square=9.49)


def test_a_latin_hypercube_has_one_plant_in_every_slice_of_every_range():
    plants = hypercube(PLANT, 64, seed=3).parameters or []
    boxes = Region.named("sensitive_ten_percent", PLANT.parameters).boxes
    assert set(boxes) == set(sensitive_symbols()) == set(plants[0])
    for symbol, (low, high) in boxes.items():
        place = (np.array([plant[symbol] for plant in plants]) - low) / (high - low) * 64
        assert sorted(np.floor(place).astype(int)) == list(range(64))


def test_an_ellipsoid_is_filled_and_not_left():
    region = joint_region()
    space = Space(region=region)
    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 4)).reshape(4, -1).T
    inside = space.latin_hypercube(500, 1)
    points = np.array([list(v.values()) for v in space.values(np.vstack([corners, inside]))])
    offset = points - [region.centre[s] for s in CALIBRATED_SYMBOLS]
    assert region.covariance is not None
    distance = np.sum(offset @ np.linalg.inv(region.covariance) * offset, axis=1)
    assert distance[:16] == pytest.approx(np.full(16, region.chi_square))  # corners are its surface
    assert distance.max() <= region.chi_square * (1 + 1e-9)
    assert distance.min() < 0.1 * region.chi_square


def test_every_point_is_one_that_the_environment_takes():
    for make in ONE_AT_A_TIME.values():
        for point in make(PLANT):
            make_settings(PLANT, **{"control_period": 5e-3, **point.options})


def test_the_parameters_are_those_of_tables_6_and_7_and_the_environment():
    factors = {point.factor for point in parameters(PLANT)}
    groups = {"partially known", "unknown", "environment"}
    named = {s for s, row in table().items() if row.group in groups}
    assert factors == named - set(CATALOGUE["local_gas_speed"])


def test_every_effect_is_there_at_growing_sizes():
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name, level, sizes in effect_levels():
        found.setdefault(name, {})[level] = sizes
    assert {name.split(" ")[0] for name in found} == set(CATALOGUE)
    symbols = {s for levels in found.values() for s in levels["top"]}
    assert symbols == {s for each in CATALOGUE.values() for s in each}
    for levels in found.values():
        assert tuple(levels) == LEVELS
        for symbol in set(levels["top"]) - {"A_pipe"}:
            sizes = [abs(levels[level][symbol]) for level in LEVELS]
            assert 0 < sizes[0] < sizes[1] < sizes[2]


def test_only_named_factors_are_changed_and_regions_stay():
    points = chosen_points(PLANT, ["regions", "parameters"], ["R"], SIZE, seed=0)
    assert {point.factor for point in points} == {"region", "R"}
    assert len(points) == len(list(regions(PLANT))) + 4


def test_batches_share_out_the_episodes_and_every_controller_meets_the_same():
    point = hypercube(PLANT, SIZE.joint_episodes, seed=0)
    first, second = cells([point], ["a", "b"], SIZE, seed=7)
    assert [batch.episodes for batch in first.batches] == [TASK_EPISODES, 8]
    assert [batch.first_seed for batch in second.batches] == [
        SWEEP_SEED + 7,
        SWEEP_SEED + 7 + TASK_EPISODES,
    ]
    assert [p for batch in first.batches for p in batch.parameters or []] == point.parameters


def test_listed_plants_are_each_episodes_own():
    study = Study(controllers={"early": EARLY}, plant=PLANT, scenario="steps", duration=0.8)
    plants = [{"V2": 0.0008}, {"V2": 0.0012}]
    both = Batch(name="b", controller="early", first_seed=5, episodes=2, parameters=plants).run(study)
    for k, plant in enumerate(plants):
        options = {"plant": PLANT, "scenario": "steps", "parameters": plant}
        alone, _ = run_episodes(EARLY, seeds=[5 + k], duration=0.8, options=options)
        assert both["excursion_bar"][k] == pytest.approx(alone.excursion_bar[0], abs=1e-6)


def test_the_control_period_is_told_to_those_who_ask():
    study = Study(controllers={"early": EARLY}, plant=PLANT, scenario="none", duration=0.6)
    assert study.controller("early", 0.01).control_period == 0.01  # type: ignore[attr-defined]
    assert study.controller("early").control_period == 5e-3  # type: ignore[attr-defined]
    assert study.controller("early") is not EARLY  # tasks of one process do not share its memory


def test_a_row_adds_its_batches_up():
    (cell,) = cells([hypercube(PLANT, SIZE.joint_episodes, 0)], ["early"], SIZE, seed=0)
    rng = np.random.default_rng(1)
    excursion = rng.uniform(0.1, 0.6, TASK_EPISODES + 8)

    def outcome(part: np.ndarray) -> Outcome:
        names = ("breakdown_bar", "recovery_s", "rms_bar", "switchings_per_s", "vented_g_per_s")
        figures = {
            "count": len(part),
            "sum": part.sum(),
            "squares": (part**2).sum(),
            "greatest": part.max(),
        }
        return {"cpu_s": 1.0, "result": {
            "episodes": len(part), "left": int((part > 0.5).sum()), "excursion_bar": part.tolist(),
            "figures": dict.fromkeys(names, figures),
        }}  # fmt: skip

    parts = {b.name: outcome(excursion[b.first_seed - SWEEP_SEED :][: b.episodes]) for b in cell.batches}
    row = point_table([cell], parts).iloc[0]
    assert row["left"] == pytest.approx(np.mean(excursion > 0.5))
    assert row["left_low"] < row["left"] < row["left_high"]
    assert row["excursion_worst_bar"] == excursion.max()
    assert row["worst_seed"] == SWEEP_SEED + np.argmax(excursion)
    assert row["switchings_per_s_mean"] == pytest.approx(excursion.mean())
    assert row["rms_bar_mean"] == pytest.approx(np.sqrt(np.mean(excursion**2)))


def test_what_is_not_finite_is_left_out_of_the_sums():
    metrics, _ = run_episodes(EARLY, seeds=[1, 2], duration=0.6, options={})
    kept = condensed(replace(metrics, rms_bar=np.array([0.2, np.nan])))
    assert kept["figures"]["rms_bar"] == {"count": 1, "sum": 0.2, "squares": 0.2**2, "greatest": 0.2}
    assert kept["left"] == 2 - metrics.stayed.sum()
    assert "stayed" not in kept["figures"]
