"""Commands of training: the whole job in its short form, and what `epv log` and `epv watch` write."""

import json
import shutil
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from subprocess import CompletedProcess

import pytest

pytest.importorskip("stable_baselines3")
import numpy as np
from PIL import Image

from epv_env.common.commands import main_of
from identification.recordings.log_files import read_log
from training.commands.watch import FRAME_PERIODS, SIZE
from training.learners.ppo import read_rows

pytestmark = pytest.mark.training
SHORT = ("--quick", "--timesteps", 4096, "--episodes", 4, "--duration", 0.55)
WRITTEN = {
    "best", "checkpoints", "comparison.csv", "comparison.png", "config.json", "learning_curve.png",
    "policy.json", "policy.safetensors", "validation.csv",
}  # fmt: skip


def train(*arguments) -> CompletedProcess:
    """Run `python training/train_ppo.py` without a new interpreter."""
    words, out, errors = [str(argument) for argument in arguments], StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(errors):
        try:
            status = main_of("training.commands.train", program="train", arguments=words)
        except SystemExit as refusal:  # argparse's
            status = int(refusal.code or 0)
    return CompletedProcess(words, status, out.getvalue(), errors.getvalue())


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "ppo"
    result = train(*SHORT, "--out", out)
    assert result.returncode == 0, result.stderr
    return out, result


def test_the_short_run_writes_everything_and_says_that_nothing_was_learnt(finished):
    out, result = finished
    assert {path.name for path in out.iterdir()} >= WRITTEN
    sentence, _, *table, _, picture, _, _, command = result.stdout.strip().splitlines()
    assert command.split()[1:] == ["train", "--out", f"{out}-full"]
    assert sentence.endswith("nothing was learnt.")
    assert (
        sum(any(name in line for name in ("PPO", "pulse", "hysteresis", "PWM")) for line in table) == 6
    )
    assert Path(picture.removeprefix("picture: ")).is_file()


def test_the_policy_says_where_it_comes_from(finished):
    out, _ = finished
    provenance = json.loads((out / "policy.json").read_text())["provenance"]
    assert provenance["seed"] == 0
    assert provenance["timesteps"] in [row["timesteps"] for row in read_rows(out)]


def test_a_resumed_run_needs_the_same_options_and_plant(finished, tmp_path):
    """Not only a plant file of the same name."""
    out = Path(shutil.copytree(finished[0], tmp_path / "ppo"))
    config = json.loads((out / "config.json").read_text())
    config["plant"]["voltage_V"] = 18.0
    (out / "config.json").write_text(json.dumps(config))
    for where, more, said in (
        (finished[0], ["--seed", 5], "resume with the same"), (out, [], "the plant is another than")
    ):  # fmt: skip
        result = train(*SHORT, "--out", where, "--resume", *more)
        assert (result.returncode, result.stderr.count("\n")) == (2, 1)
        assert said in result.stderr


def test_a_finished_run_is_not_overwritten_unasked(finished):
    out, _ = finished
    before = (out / "policy.safetensors").read_bytes()
    result = train("--timesteps", 4096, "--out", out, "--seed", 5)
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)
    assert "holds a training: give --resume" in result.stderr
    assert (out / "policy.safetensors").read_bytes() == before


def log(*words: object) -> int:
    """Run `epv log` under a simple controller, two drives of a second unless the words say otherwise."""
    line = ["--controller", "hysteresis", "--drives", 2, "--duration", 1.0, *words]
    return main_of("training.commands.log", program="epv log", arguments=[str(word) for word in line])


def test_an_effect_acts_from_its_drive_on(tmp_path):
    assert log("--out", tmp_path / "as-it-is") == 0
    assert log("--out", tmp_path / "late", "--effect", "command_delay", "--from-drive", 2) == 0
    same, other = (
        [drive.p3 for drive in read_log(tmp_path / name).drives] for name in ("as-it-is", "late")
    )
    np.testing.assert_array_equal(same[0], other[0])
    assert len(same[1]) == len(other[1]) == 200
    assert np.any(same[1] != other[1])


WATCH = "training.commands.watch"


@pytest.mark.parametrize("controller", ["hysteresis", "PWM", "PPO", "informed pulse"])
def test_a_film_has_a_frame_for_every_other_period(controller, tmp_path, monkeypatch):
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    path = tmp_path / "valve.gif"
    arguments = [controller, "--file", str(path), "--duration", "0.08"]
    assert main_of(WATCH, program="epv watch", arguments=arguments) == 0
    with Image.open(path) as film:
        periods = 4 if controller == "PWM" else 16
        assert (film.size, film.n_frames) == (SIZE, periods // FRAME_PERIODS)  # type: ignore[attr-defined]
