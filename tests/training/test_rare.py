"""Splitting knows probabilities that are known; episodes made of normal numbers are episodes."""

import json

import numpy as np
import pytest

pytest.importorskip("joblib")
from scipy.special import ndtri
from scipy.stats import kstest

from controllers.knowledge import ValveKnowledge, forced, keeps_on
from controllers.policy import load_policy
from controllers.tuned import tuned
from controllers.valve_learner import LEARNT
from epv_env.common.commands import main_of
from epv_env.observation import INDEX, LAYOUT, LIMIT, decode
from epv_env.plant.consumption import SCENARIOS
from epv_env.plant.plantfile import Plant
from tests.training.closed_forms import CASES, coverage
from training.evaluation.rollout import run_episodes
from training.rare.episodes import DISTURBANCE, PLANT, Episodes, NormalsAsDraws
from training.rare.splitting import CHAIN, Moves, Problem, interval

pytestmark = pytest.mark.training


def test_moves_leave_normal_numbers_normal_and_change_what_they_may():
    rng = np.random.default_rng(0)
    moves = Moves(drawn=6, in_time=20)
    before = normals = rng.standard_normal((4000, 26))
    for _ in range(4):
        normals = moves(normals, rng)
    assert kstest(normals.ravel(), "norm").pvalue > 0.01
    assert abs(np.corrcoef(normals.T) - np.eye(26)).max() < 0.08  # five standard deviations
    assert np.all(np.mean(normals != before, axis=0) > 0.3)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("trials", "least"), [(10, 8), pytest.param(100, 93, marks=pytest.mark.slow)])
def test_the_interval_holds_a_known_probability(name, trials, least):
    hits, ratio = coverage(CASES[name], trials=trials, particles=512, repetitions=10)
    assert hits >= least
    assert ratio == pytest.approx(1.0, abs=1.0 / np.sqrt(trials))


def test_an_assumed_share_is_biased_where_levels_tie_and_a_counted_one_is_not():
    case = CASES["birth-death chain"]
    problem = Problem(level=case.level, moves=case.moves, particles=512)
    assumed, counted = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found = problem.thresholds(case.threshold, 1e-9, rng)
        repetition = problem.repetition(found, rng)
        assumed.append(repetition.shares[-1] / CHAIN ** (len(found) - 1))
        counted.append(repetition.probability)
    assert np.mean(assumed) / case.truth > 1.3
    assert np.mean(counted) == pytest.approx(case.truth, rel=0.25)


def test_a_level_that_is_never_reached_gives_no_estimate_above_zero():
    problem = Problem(level=lambda z: np.minimum(z[:, 0], 1.0), moves=Moves(drawn=2), particles=64)
    found = problem.thresholds(2.0, 1e-6, np.random.default_rng(0))
    assert found[-1] < 1.0  # they end below
    estimates = [problem.repetition([*found, 2.0], np.random.default_rng(k)) for k in range(3)]
    assert [each.probability for each in estimates] == [0.0] * 3
    assert interval(np.zeros(3)) == (0.0, 0.0)


def test_normals_draw_what_a_generator_draws():
    normals = ndtri(np.random.default_rng(3).random(700))
    drawn = SCENARIOS["steps"].draw(NormalsAsDraws(normals))  # type: ignore[arg-type]
    expected = SCENARIOS["steps"].draw(np.random.default_rng(3))
    np.testing.assert_allclose(drawn.applications, expected.applications, rtol=1e-12)
    assert drawn.leak == pytest.approx(expected.leak)
    assert [NormalsAsDraws(np.full(1, z)).integers(7) for z in (-9.0, 0.0, 9.0)] == [0, 3, 6]


def test_episodes_of_normals_are_those_of_the_seeds_that_gave_them():
    options = {"parameters": "sensitive_ten_percent", "scenario": "steps"}
    controller = tuned("extrapolating hysteresis")
    episodes = Episodes(controller=controller, duration=1.5, options=options)
    normals = np.zeros((3, episodes.moves.drawn + episodes.moves.in_time))
    for seed, row in enumerate(normals):
        own = int(np.random.default_rng(seed).integers(2**63))
        plant, disturbance, noise = (np.random.default_rng((own, stream)) for stream in range(3))
        row[:PLANT] = ndtri(plant.random(PLANT))
        row[PLANT : PLANT + DISTURBANCE] = ndtri(disturbance.random(DISTURBANCE))
        noise.standard_normal(out=row[PLANT + DISTURBANCE :])
    expected = run_episodes(controller, seeds=[0, 1, 2], duration=1.5, options=options)
    np.testing.assert_allclose(episodes.worst(normals), expected.excursion_bar, atol=1e-6)


def test_the_command_resumes_and_describes_the_episodes_that_leave(tmp_path, capsys):
    words = ["--quick", "--controller", "PWM", "--out", str(tmp_path), "--workers", "1"]
    for _ in range(2):
        assert main_of("training.commands.rare", program="epv rare", arguments=words) == 0
    journal = (tmp_path / "finished.jsonl").read_text(encoding="utf-8")
    assert journal.count('"check"') == 3  # thresholds and two repetitions, once
    result = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert 0 <= result["low"] <= result["probability"] <= result["high"] <= 1
    for episode in result["episodes"]:
        assert episode["worst_bar"] > 0.5
        assert all(-1e-9 <= place <= 1 + 1e-9 for place in episode["place"].values())
    assert "PWM leaves" in capsys.readouterr().out


def test_a_device_that_is_not_there_is_refused(tmp_path, capsys):
    words = ["--quick", "--device", "cuda", "--out", str(tmp_path / "out")]
    assert main_of("training.commands.rare", program="epv rare", arguments=words) == 2
    assert "needs an NVIDIA accelerator" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def random_observations(n, rng):
    """Observations with nothing in common but the box of the 13 readings, all near the band."""
    seen = LIMIT * rng.uniform(-1.0, 1.0, (n, len(LAYOUT)))
    seen[:, INDEX["p2_error"]] = rng.uniform(-3.0, 3.0, n)
    seen[:, INDEX["target"]] = rng.uniform(-0.5, 0.5, n)
    seen[:, INDEX["action"]] = rng.choice([-1.0, 1.0], n)
    return seen.astype(np.float32)


def outside(seen):
    """Whether p2 lies above the band, and whether shield 4 is asked for, (n,) each."""
    error, target, p1, p3, coil = (
        decode(seen, name) for name in ("p2_error", "target", "p1", "p3", "action")
    )
    ready = (coil > 0.5) & (p1 - error - target >= 1.0) & (p1 - p3 <= 0.5)
    return error >= 0.5, (error <= -0.5) & ready


def test_no_reading_opens_above_the_band_or_keeps_shut_below_it_and_without_shields_some_do():
    rng = np.random.default_rng(0)
    controller, knowledge = load_policy(), ValveKnowledge(Plant.calibrated())
    controller.reset(500)
    knowledge.reset(500)
    without = {"above": 0, "opened": 0, "below": 0, "stayed shut": 0}
    for _ in range(20):
        seen = random_observations(500, rng)
        above, below = outside(seen)
        off, on = controller.network.logits(knowledge.observe(seen)).T
        ruled = np.array([keeps_on(v) for v in knowledge.valves])
        bare = np.where(ruled | ~(off >= on), 1, 0)
        forces = np.array(
            [
                forced(v, error)
                for v, error in zip(knowledge.valves, decode(seen, "p2_error"), strict=True)
            ]
        )
        shielded = np.where(forces > 0, 1, np.where(forces < 0, 0, bare))
        assert np.all(shielded[above] == 1)
        assert np.all(shielded[below & ~ruled] == 0)
        counts = above, above & (bare == 0), below & ~ruled, below & ~ruled & (bare == 1)
        for name, which in zip(without, counts, strict=True):
            without[name] += int(which.sum())
        lost = rng.random(seen.shape) < 0.01
        seen[lost] = rng.choice([np.nan, np.inf, -np.inf], lost.sum())
        actions = controller.act(seen)
        assert set(actions) <= {0, 1}
        error = decode(seen, "p2_error")
        assert np.all(actions[(error >= 0.5) & np.isfinite(error + decode(seen, "target"))] == 1)
    assert min(without.values()) > 0


def test_no_input_of_the_box_makes_a_logit_that_is_no_number():
    """Interval arithmetic (Moore, Interval Analysis, 1966): sound bounds of every layer."""
    network = load_policy().network
    box = np.array([quantity.limit for quantity in (*LAYOUT, *LEARNT)])
    low, high = -box, box
    for weight, bias in network.layers:
        middle, reach = weight @ (low + high) / 2 + bias, np.abs(weight) @ (high - low) / 2
        assert np.all(np.abs(middle) + reach < 1e3)
        low, high = np.tanh(middle - reach), np.tanh(middle + reach)
    assert np.all(np.isfinite(network.advice_weight))
