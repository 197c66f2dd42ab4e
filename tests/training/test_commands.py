"""The command lines: the whole job in its short form, and one clear sentence for a wrong input."""

import json
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from controllers.learned import load_policy
from controllers.registry import SIMULATING_KINDS
from controllers.supervised import load_settings
from controllers.tuned import load_tunings
from epv_env.common.command_line import fail_clearly

pytest.importorskip("stable_baselines3")
from training import train_ppo

pytestmark = pytest.mark.training

ROOT = Path(__file__).parents[2]
SHORT = ("--quick", "--timesteps", 16384, "--episodes", 4, "--duration", 0.55)
"""A training and an evaluation that are shorter than those of --quick."""
WRITTEN = (
    "checkpoint.zip", "config.json", "episode.png", "excursions.png", "learning_curve.csv",
    "learning_curve.png", "model.zip", "policy.json", "policy.safetensors", "table.csv", "table.json",
    "tensorboard", "validation.csv",
)  # fmt: skip


def command(*arguments, script="training/train_ppo.py"):
    """Run a script of the project as a user does."""
    return subprocess.run(
        [sys.executable, str(ROOT / script), *map(str, arguments)],
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip


def command_here(*arguments, script=train_ppo):
    """The same without a new interpreter, which takes seconds to import torch."""
    words, out, errors = [str(argument) for argument in arguments], StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(errors):
        try:
            status = fail_clearly(lambda: script.main(words))
        except SystemExit as refusal:  # argparse's
            status = int(refusal.code or 0)
    return subprocess.CompletedProcess(words, status, out.getvalue(), errors.getvalue())


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("run")
    result = command(*SHORT, "--no-memory", "--out", out)
    assert result.returncode == 0, result.stderr
    return out, result


def test_the_short_run_writes_everything_and_prints_the_table(finished):
    out, result = finished
    assert sorted(path.name for path in out.iterdir()) == sorted(WRITTEN)
    for heading in ("C1 stayed", "C2 largest breakdown [bar]", "sensitive_ten_percent", "PPO", "PWM"):
        assert heading in result.stdout
    assert len(json.loads((out / "table.json").read_text())) == 3 * (
        1 + len(set(load_tunings()) - set(SIMULATING_KINDS))
    )


def test_a_run_resumes_from_its_checkpoint(finished):
    out, _ = finished
    before = (out / "learning_curve.csv").read_text().splitlines()
    result = command_here(*SHORT, "--no-memory", "--out", out, "--resume")
    assert result.returncode == 0, result.stderr
    assert (out / "learning_curve.csv").read_text().splitlines()[: len(before)] == before


def test_a_run_has_one_identity_in_all_that_it_writes(finished):
    out, _ = finished
    run = json.loads((out / "config.json").read_text())["run"]
    assert json.loads((out / "policy.json").read_text())["provenance"]["run"] == run
    for table in ("learning_curve.csv", "validation.csv"):
        assert {line.split(",")[-1] for line in (out / table).read_text().splitlines()[1:]} == {run}


def test_a_finished_run_is_not_overwritten_unasked(finished):
    out, _ = finished
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    result = command_here("--quick", "--no-memory", "--out", out, "--seed", "5")
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)
    assert "holds a finished training: give --force to replace it" in result.stderr
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_resumed_run_never_hands_out_another_runs_policy(finished, tmp_path):
    """The checkpoint of another seed, put under a new configuration."""
    out, _ = finished
    config = json.loads((out / "config.json").read_text())
    config["run"], config["options"]["seed"] = "0" * 32, 5
    (tmp_path / "config.json").write_text(json.dumps(config))
    shutil.copy(out / "checkpoint.zip", tmp_path)
    result = command_here("--quick", "--no-memory", "--out", tmp_path, "--resume", "--seed", "5")
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)
    assert "belongs to the training run" in result.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"config.json", "checkpoint.zip"}
    assert json.loads((tmp_path / "config.json").read_text()) == config


def test_a_policy_with_a_memory_is_trained_in_the_short_form_too(tmp_path):
    result = command_here(*SHORT, "--no-end-to-end", "--out", tmp_path)
    assert result.returncode == 0, result.stderr
    assert "PPO, recurrent, supervised" in result.stdout
    assert load_settings(tmp_path) is not None
    assert json.loads((tmp_path / "policy.json").read_text())["memory"]["unit"] == "GRU"
    result = command_here("--quick", "--no-memory", "--out", tmp_path, "--resume")
    assert "was trained with memory True, not False" in result.stderr


def test_a_memory_is_trained_end_to_end(tmp_path):
    where = (*SHORT, "--out", tmp_path)
    result = command_here(*where)
    assert result.returncode == 0, result.stderr
    learned, student = (load_policy(folder) for folder in (tmp_path, tmp_path / "student"))
    assert learned.cell is not None
    assert student.cell is not None
    assert learned.cells == student.cells == 32
    assert learned.name == "PPO, end to end"
    assert not np.array_equal(learned.cell.weight_memory, student.cell.weight_memory)
    again = command_here(*where, "--resume", "--no-end-to-end")
    assert "was trained with end_to_end True, not False" in again.stderr


def test_resuming_with_another_seed_is_refused(finished):
    out, _ = finished
    result = command("--quick", "--no-memory", "--out", out, "--resume", "--seed", "5")
    assert result.returncode == 2
    assert "resume with the same" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--scenario", "flood"], "unknown consumption scenario 'flood'"),
        (["--plant", "nowhere.json"], "cannot read plant file nowhere.json"),
        (["--timesteps", "0"], "--timesteps must be positive"),
        (["--duration", "inf"], "--duration must be positive and finite"),
        (["--seed", "-1"], "--seed must not be negative"),
        (["--out", "/dev/null/x"], "is not a folder"),
        (["--resume"], "nothing to resume"),
        (["--end-to-end", "--no-memory"], "--end-to-end trains a memory"),
    ],
)
def test_wrong_input_gets_one_sentence_and_leaves_nothing(arguments, words, tmp_path):
    out = tmp_path / "out"
    where = [] if "--out" in arguments else ["--out", out]
    result = command_here("--quick", *arguments, *where)
    assert result.returncode == 2
    assert words in result.stderr
    assert "Traceback" not in result.stderr
    assert not out.exists()
