"""A sweep's results do not depend on who computes them, nor on being killed."""

import json
import os
import signal
import time

import pytest

pytest.importorskip("joblib")
pytest.importorskip("pandas")
from tests.training.sweeps import TASKS, finished, sweep, sweep_process, write_policy
from training.sweep import main

pytestmark = pytest.mark.training


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A sweep on one core, which fills a page, too."""
    out = tmp_path_factory.mktemp("alone")
    (out / "page.md").write_text("# Page\n<!-- generated: worst -->\n<!-- end: worst -->\n")
    chosen = ("--controllers", "hysteresis, extrapolating", "--pages", out / "page.md")
    return out, sweep(out, *chosen, "--workers", 1)


def killed(out, how, lines):
    """Start a sweep on two processes, and stop it when some tasks are finished."""
    process = sweep_process(out, "--controllers", "hysteresis, extrapolating", "--workers", 2)
    while len(finished(out)) < lines and process.poll() is None:
        time.sleep(0.02)
    os.killpg(process.pid, how)
    _, errors = process.communicate(timeout=600)
    return process.returncode, errors


def test_two_workers_and_a_killed_sweep_give_the_same_to_the_bit(alone, tmp_path):
    killed(tmp_path, signal.SIGKILL, 3)
    before = finished(tmp_path)
    assert 3 <= len(before) < TASKS  # it was killed in mid-sweep
    result = sweep(tmp_path, "--controllers", "hysteresis, extrapolating", "--workers", 2)
    assert result == alone[1]
    after = finished(tmp_path)
    assert after[: len(before)] == before  # nothing was lost
    assert len(after) == len(set(after)) == TASKS  # nor done twice


def test_interrupting_keeps_what_is_finished_and_says_so_in_one_line(tmp_path):
    status, errors = killed(tmp_path, signal.SIGINT, 1)
    assert status == 130
    assert "interrupted: what was finished is kept" in errors
    assert "Traceback" not in errors
    assert finished(tmp_path)


def test_what_a_sweep_writes(alone):
    out, result = alone
    content = json.loads(result)
    assert {row["factor"] for row in content["points"]} >= {"sensor noise", "control period"}
    assert {each["region"] for each in content["worst"]} == {"confidence", "sensitive_ten_percent"}
    names = {path.name for path in out.iterdir()}
    assert names >= {
        "points.csv", "hypercube.csv", "cost.json", "robustness-conditions.png",
        "robustness-hypercube.png", "robustness-worst.png",
    }  # fmt: skip
    assert "| sensitive_ten_percent | hysteresis, extrapolating |" in (out / "page.md").read_text()
    spent = json.loads((out / "cost.json").read_text())["controllers"]["hysteresis, extrapolating"]
    assert spent["million_on_one_machine_s"] > spent["million_on_100_machines_s"] > 0


def test_another_configuration_is_refused(alone):
    out, _ = alone
    with pytest.raises(ValueError, match=r"holds a sweep with seed 0, not 1: go on with the same"):
        sweep(out, "--controllers", "hysteresis, extrapolating", "--seed", 1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--controllers", "nobody"], "no controller 'nobody': give a folder that training wrote"),
        (["--factors", "luck"], "no factor 'luck' in the designs"),
        (["--pages", "nowhere.md"], "no page nowhere.md"),
        (["--scenario", "flood"], "unknown consumption scenario 'flood'"),
        (["--plant", "nowhere.json"], "cannot read plant file nowhere.json"),
    ],
)
def test_wrong_input_gets_one_sentence_and_leaves_nothing(arguments, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        main(["--quick", "--out", str(tmp_path / "out"), *arguments])
    assert not (tmp_path / "out").exists()


def test_policies_are_named_and_told_apart(tmp_path):
    one, other = write_policy(tmp_path / "one"), write_policy(tmp_path / "other", seed=1)
    with pytest.raises(ValueError, match="two controllers are called 'PPO': give one as LABEL=FOLDER"):
        sweep(tmp_path / "out", "--controllers", one, other)
    only = ("--designs", "conditions", "--factors", "latency", "--episodes", 2)
    content = json.loads(sweep(tmp_path / "out", "--controllers", one, f"B={other}", *only))
    assert {row["controller"] for row in content["points"]} == {"PPO", "B"}
    assert len(set(content["configuration"]["controllers"].values())) == 2
