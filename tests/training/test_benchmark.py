"""The benchmark trains on equal terms, scores on held-out episodes, and keeps what is finished."""

import json
import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from controllers.hysteresis import Hysteresis
from epv_env import MAX_EPISODE_STEPS
from epv_env.common.files import JSONFileError
from epv_env.sb3 import make_sb3_env
from training import benchmark
from training.evaluation.benchmark import FIGURES, score
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import BENCHMARK_SEED
from training.learners.library_algorithms import ALGORITHMS, NUM_ENVS, make_library_model
from training.learners.library_policy import LibraryPolicy
from training.learners.library_training import MODEL_FILE, train_library_algorithm
from training.studies.benchmark.result_file import (
    Entry,
    Results,
    Run,
    joined,
    read_results,
    write_results,
)
from training.studies.benchmark.score_table import estimate, ranked, score_table

pytestmark = pytest.mark.training

ROOT = Path(__file__).parents[2]
PUBLISHED = ROOT / "docs/results/benchmark.json"


def run(value, seed=0):
    """A run with this return."""
    return Run(
        seed=seed, mean_return=value, left_share=0.5, rms_error_bar=0.1, switchings_per_s=5.0
    )  # fmt: skip


def entry(name, *values, environment="EPValve-v0", timesteps: int | None = 100):
    runs = [run(float(value), seed) for seed, value in enumerate(values)]
    return Entry(algorithm=name, environment=environment, timesteps=timesteps, runs=runs)


SHARE_OF_TWO = {
    "algorithm": "a", "environment": "EPValve-v0",
    "runs": [{"mean_return": -1.0, "left_share": 2.0, "rms_error_bar": 0.1, "switchings_per_s": 1.0}],
}  # fmt: skip


def files(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", ALGORITHMS)
def test_an_algorithm_acts_where_its_record_says_and_nowhere_else(name):
    algorithm = ALGORITHMS[name]
    assert algorithm.name == name
    for environment in MAX_EPISODE_STEPS:
        env = make_sb3_env(environment, NUM_ENVS)
        if environment in algorithm.environments:
            policy = LibraryPolicy(
                model=make_library_model(algorithm, env, seed=0), environment=environment
            )
            policy.reset(NUM_ENVS)
            actions = policy.act(env.reset())
            assert all(env.action_space.contains(action) for action in actions)
        else:
            with pytest.raises((AssertionError, ValueError)):
                make_library_model(algorithm, env, seed=0)


def test_each_environment_has_at_least_six_algorithms():
    for environment in MAX_EPISODE_STEPS:
        assert sum(environment in a.environments for a in ALGORITHMS.values()) >= 6


def test_a_training_is_repeatable_and_its_seed_counts(tmp_path):
    def weights(seed, folder):
        trained = train_library_algorithm(
            ALGORITHMS["a2c"], "EPValvePWM-v0", seed=seed, timesteps=160, folder=tmp_path / folder
        )
        assert trained.timesteps == 160
        parameters = trained.model.policy.parameters()
        return np.concatenate([p.detach().numpy().ravel() for p in parameters])

    first = weights(1, "a")
    assert np.array_equal(first, weights(1, "b"))
    assert not np.array_equal(first, weights(2, "c"))


def test_progress_counts_every_step(tmp_path):
    steps = []
    train_library_algorithm(
        ALGORITHMS["dqn"], "EPValve-v0", seed=0, timesteps=160, folder=tmp_path, progress=steps.append
    )
    assert sum(steps) == 160


def test_a_written_model_is_the_trained_one(tmp_path):
    from stable_baselines3 import A2C

    trained = train_library_algorithm(
        ALGORITHMS["a2c"], "EPValve-v0", seed=0, timesteps=80, folder=tmp_path
    )
    again = A2C.load(tmp_path / MODEL_FILE)
    policies = [LibraryPolicy(model=m, environment="EPValve-v0") for m in (trained.model, again)]
    first, second = (score(policy, episodes=2, duration=0.6) for policy in policies)
    assert first == second


def test_a_recurrent_policy_remembers_within_its_episodes_only():
    env = make_sb3_env("EPValvePWM-v0", NUM_ENVS)
    model = make_library_model(ALGORITHMS["ppo_lstm"], env, seed=0)
    policy = LibraryPolicy(model=model, environment="EPValvePWM-v0")
    seen = env.reset()
    policy.reset(NUM_ENVS)
    first, second = policy.act(seen), policy.act(seen)
    policy.reset(NUM_ENVS)
    assert np.array_equal(policy.act(seen), first)
    assert not np.array_equal(second, first)


def test_a_score_is_the_mean_over_the_benchmarks_episodes():
    controller = Hysteresis(open_below=-0.1, shut_above=0.0)
    whole = score(controller, episodes=3, duration=1.0)
    single = [
        run_episodes(controller, seeds=[BENCHMARK_SEED + k], duration=1.0, options={})[0]
        for k in range(3)
    ]
    assert whole["mean_return"] == pytest.approx(np.mean([m.episode_return[0] for m in single]))
    assert whole["left_share"] == pytest.approx(1 - np.mean([m.stayed[0] for m in single]))
    squares = [m.rms_bar[0] ** 2 for m in single]
    assert whole["rms_error_bar"] == pytest.approx(np.sqrt(np.mean(squares)))


def test_the_episodes_are_those_of_the_environments_default():
    for environment, steps in MAX_EPISODE_STEPS.items():
        period = gymnasium.make(environment).get_wrapper_attr("settings").control_period
        assert steps * period == pytest.approx(benchmark.DURATION)


def test_the_interval_is_that_of_the_interquartile_mean():
    runs = [run(value) for value in (1.0, 2.0, 3.0, 4.0, 1000.0)]
    found = estimate(runs, FIGURES[0])
    assert found.value == pytest.approx(3.0)  # one run is cut at each end
    assert 1.0 <= found.low < 3.0 < found.high
    alone = estimate(runs[:1], FIGURES[0])
    assert (alone.low, alone.value, alone.high) == (1.0, 1.0, 1.0)


def test_the_table_ranks_by_the_return_and_marks_what_is_not_trained():
    entries = [
        entry("poor", -9, -8, -7), entry("good", -3, -2, -1), entry("classic", -5, timesteps=None),
        entry("other", 0, environment="EPValvePWM-v0"),
    ]  # fmt: skip
    assert [row.entry.algorithm for row in ranked(entries, "EPValve-v0")] == ["good", "classic", "poor"]
    lines = score_table(entries, "EPValve-v0").splitlines()[2:]
    assert lines[0].startswith("| good | 100 | 3 | -2 (")
    assert lines[1].startswith("| *classic* | – | – | -5 |")


def test_results_come_back_from_their_file(tmp_path):
    results = Results(entries=[entry("mine", -3, -2)])
    write_results(tmp_path / "mine.json", results)
    assert read_results(tmp_path / "mine.json") == results


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"entries": [{"algorithm": "a", "environment": "Valve", "runs": []}]}, "give EPValve-v0"),
        ({"entries": [{"algorithm": "a", "environment": "EPValve-v0", "runs": []}]}, "give one at"),
        ({"entries": [{"algorithm": "a"}]}, "'environment' is missing"),
        ({"entries": [SHARE_OF_TWO]}, "<= 1.0"),
        ({"format": "epv-benchmark/0"}, "this version reads 'epv-benchmark/1'"),
    ],
)
def test_a_file_of_another_form_is_refused(change, words, tmp_path):
    path = tmp_path / "mine.json"
    write_results(path, Results(entries=[entry("mine", -3)]))
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(JSONFileError, match=words):
        read_results(path)


def test_only_results_on_the_same_episodes_stand_side_by_side():
    own = Results(entries=[entry("own", -3)])
    together = joined(own, [Results(entries=[entry("theirs", -2)])])
    assert [e.algorithm for e in together.entries] == ["own", "theirs"]
    with pytest.raises(ValueError, match=r"on 8 episodes of 10 s .* score on the same"):
        joined(own, [Results(episodes=8, entries=[entry("theirs", -2)])])
    with pytest.raises(ValueError, match="called 'own': give yours another name"):
        joined(own, [Results(entries=[entry("own", -2)])])


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("benchmark")
    assert benchmark.main(["--quick", "--out", str(out)]) == 0
    return out


def test_the_command_writes_results_models_and_a_figure(finished):
    results = read_results(finished / benchmark.RESULT_FILE)
    trained = [e for e in results.entries if e.timesteps is not None]
    assert [(e.environment, e.algorithm) for e in trained] == [
        ("EPValve-v0", "A2C"), ("EPValvePWM-v0", "A2C"),
    ]  # fmt: skip
    assert results.episodes == benchmark.QUICK["episodes"]
    assert (finished / "EPValve-v0/a2c/seed-0" / MODEL_FILE).is_file()
    assert (finished / benchmark.FIGURE_FILE).read_bytes().startswith(b"\x89PNG")
    assert {e.algorithm for e in results.entries if e.timesteps is None} >= {"PWM", "pulse, adaptive"}


def test_finished_trainings_are_kept_and_others_added(finished):
    before = (finished / benchmark.JOURNAL_FILE).read_text()
    model = finished / "EPValve-v0/a2c/seed-0" / MODEL_FILE
    trained_at = model.stat().st_mtime_ns
    arguments = ["--quick", "--algo", "a2c", "dqn", "--out", str(finished)]
    assert benchmark.main(arguments) == 0
    after = (finished / benchmark.JOURNAL_FILE).read_text()
    assert after.startswith(before)
    assert [json.loads(line)["name"] for line in after[len(before) :].splitlines()] == [
        "EPValve-v0/dqn/seed-0"
    ]
    assert model.stat().st_mtime_ns == trained_at


def test_results_of_others_stand_in_the_table(finished, capsys):
    quick = benchmark.QUICK
    theirs = Results(
        episodes=quick["episodes"], duration_s=quick["duration"], entries=[entry("theirs", -1, -2)]
    )
    write_results(finished / "theirs.json", theirs)
    arguments = ["--quick", "--out", str(finished), "--beside", str(finished / "theirs.json")]
    assert benchmark.main(arguments) == 0
    assert "| theirs | 100 | 2 | -2 (-2 to -1) |" in capsys.readouterr().out
    own = read_results(finished / benchmark.RESULT_FILE)
    assert "theirs" not in {e.algorithm for e in own.entries}


def test_a_folder_keeps_its_budget(finished):
    before = files(finished)
    with pytest.raises(ValueError, match="holds a benchmark with timesteps 400, not 800"):
        benchmark.main(["--quick", "--timesteps", "800", "--out", str(finished)])
    assert files(finished) == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--algo", "sac", "--env", "EPValve-v0"], "--algo sac cannot act in EPValve-v0"),
        (["--algo", "sarsa"], "invalid choice: 'sarsa'"),
        (["--seeds", "0"], "--seeds must be positive"),
        (["--timesteps", "-1"], "--timesteps must be positive"),
    ],
)
def test_options_that_cannot_work_are_refused(arguments, words, tmp_path, capsys):
    with pytest.raises(SystemExit):
        benchmark.main([*arguments, "--out", str(tmp_path / "out")])
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_more_training_seeds_than_there_are_episodes_for_are_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        benchmark.main(["--seeds", "70000", "--out", str(tmp_path / "out")])
    assert "--seeds must be at most 1000" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_page_shows_the_published_results():
    results = read_results(PUBLISHED)
    page = (ROOT / "docs/results/benchmark.md").read_text(encoding="utf-8")
    for environment in MAX_EPISODE_STEPS:
        shown = re.search(
            f"<!-- generated: {environment} -->\n(.*?)\n<!-- end: {environment} -->", page, re.S
        )
        assert shown is not None
        assert shown[1] == score_table(results.entries, environment)
    trained = [e for e in results.entries if e.timesteps is not None]
    assert {e.timesteps for e in trained} == {benchmark.TIMESTEPS}
    assert len({tuple(run.seed for run in e.runs) for e in trained}) == 1  # the same for all
