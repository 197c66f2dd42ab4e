"""Splitting knows probabilities that are known; episodes made of normal numbers are episodes."""

import json

import numpy as np
import pytest

pytest.importorskip("joblib")
from scipy.special import ndtri
from scipy.stats import kstest

from controllers.policy import load_policy
from controllers.tuned import tuned
from docs.studies.rare.closed_forms import CASES, coverage, naive
from docs.studies.rare.properties import counterexamples, logit_bounds, random_observations
from epv_env.common.commands import main_of
from epv_env.observation import decode
from epv_env.plant.consumption import SCENARIOS
from training.evaluation.rollout import run_episodes
from training.rare.episodes import DISTURBANCE, PLANT, Episodes, NormalsAsDraws
from training.rare.splitting import Moves, Problem, interval

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
def test_the_interval_holds_a_known_probability(name):
    """In 93 of 100 trials: the study has them all, with more particles."""
    hits, ratio = coverage(CASES[name], trials=10, particles=512, repetitions=10)
    assert hits >= 8  # of 10 with a coverage of 0.95: a lower count has a probability of 0.01
    assert ratio == pytest.approx(1.0, abs=0.25)


def test_an_assumed_share_is_biased_where_levels_tie_and_a_counted_one_is_not():
    case = CASES["birth-death chain"]
    assumed = np.mean([naive(case, seed, particles=512) for seed in range(20)])
    counted = np.mean([case.estimates(seed, particles=512, repetitions=1) for seed in range(20)])
    assert assumed / case.truth > 1.3
    assert counted == pytest.approx(case.truth, rel=0.25)


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
    controller = tuned("hysteresis, extrapolating")
    episodes = Episodes(controller=controller, duration=1.5, options=options)
    normals = np.zeros((3, episodes.moves.drawn + episodes.moves.in_time))
    for seed, row in enumerate(normals):
        own = int(np.random.default_rng(seed).integers(2**63))
        plant, disturbance, noise = (np.random.default_rng((own, stream)) for stream in range(3))
        row[:PLANT] = ndtri(plant.random(PLANT))
        row[PLANT : PLANT + DISTURBANCE] = ndtri(disturbance.random(DISTURBANCE))
        noise.standard_normal(out=row[PLANT + DISTURBANCE :])
    expected, _ = run_episodes(controller, seeds=[0, 1, 2], duration=1.5, options=options)
    np.testing.assert_allclose(episodes.worst(normals), expected.excursion_bar, atol=1e-6)


def test_the_command_resumes_and_describes_the_episodes_that_leave(tmp_path, capsys):
    words = ["--quick", "--controller", "PWM", "--out", str(tmp_path), "--workers", "1"]
    for _ in range(2):
        assert main_of("training.commands.rare", program="epv rare", arguments=words) == 0
    journal = (tmp_path / "finished.jsonl").read_text(encoding="utf-8")
    assert journal.count('"name"') == 3  # thresholds and two repetitions, once
    result = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert 0 <= result["low"] <= result["probability"] <= result["high"] <= 1
    for episode in result["episodes"]:
        assert episode["worst_bar"] > 0.5
        assert all(-1e-9 <= place <= 1 + 1e-9 for place in episode["place"].values())
    assert "PWM leaves" in capsys.readouterr().out


def test_above_the_band_no_reading_opens_and_below_it_none_keeps_shut():
    rng = np.random.default_rng(0)
    controller, n = load_policy(), 500
    controller.reset(n)
    for _ in range(20):
        seen = random_observations(n, rng)
        lost = rng.random(seen.shape) < 0.01
        seen[lost] = rng.choice([np.nan, np.inf, -np.inf], lost.sum())
        actions = controller.act(seen)
        assert set(actions) <= {0, 1}
        assert np.all(actions[decode(seen, "p2_error") >= 0.5] == 1)


def test_without_the_shields_readings_do_both():
    found = counterexamples(episodes=200)
    assert found["opened"] > 0
    assert found["stayed shut"] > 0
    low, high = logit_bounds(load_policy().main.network)  # type: ignore[attr-defined]
    assert np.all((low > -20) & (high < 20))  # no input of the box makes a logit that is no number
