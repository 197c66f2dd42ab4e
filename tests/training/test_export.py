"""The exported policy decides as the policy does, wherever it is compiled, and its tests can fail."""

import ctypes
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controllers.policy import TRAINED, load_policy
from controllers.policy_files import read_policy
from epv_env.observation import CENTRE, INDEX, P3_LAGS, SCALE, contract, decode
from tests.training.exports import (
    GOOD,
    column,
    command,
    copied,
    export,
    inputs,
    random_policy,
    readings,
    replay,
    sanitisers,
)
from training.commands.export import FILES
from training.deploy.agreement import follow, visit
from training.deploy.c_code import MEMORY
from training.deploy.compiled import CompiledPolicy, build, library

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """The package's policy and its export."""
    out = tmp_path_factory.mktemp("fitted") / "ecu"
    assert export(TRAINED, out) == 0
    return TRAINED, out


@pytest.fixture(scope="module")
def random(tmp_path_factory):
    """A policy that means nothing, of another shape, and its export."""
    folder = tmp_path_factory.mktemp("random")
    policy = random_policy(folder / "policy")
    assert export(policy, folder / "ecu") == 0
    return policy, folder / "ecu"


@pytest.fixture(params=["fitted", "random"])
def exported(request):
    """Any."""
    return request.getfixturevalue(request.param)


@pytest.fixture
def copy(fitted, tmp_path):
    """An export that a test may spoil."""
    return Path(shutil.copytree(fitted[1], tmp_path / "copy"))


@pytest.fixture
def any_copy(exported, tmp_path):
    """The same of any."""
    return Path(shutil.copytree(exported[1], tmp_path / "copy"))


def test_an_export_is_complete_and_within_its_bars(exported):
    _, out = exported
    assert {path.name for path in out.iterdir()} == FILES - {"epv_policy.fmu"}
    report = json.loads((out / "report.json").read_text())
    assert report["agreement"]["states"] == 10_000
    assert report["agreement"]["agrees"] >= 9_999  # single precision may pass a threshold
    loop = report["closed_loop"]["controllers"]
    assert loop["C"]["rms_error_bar"] == pytest.approx(loop["PPO"]["rms_error_bar"], rel=0.05)


def test_the_package_s_policy_decides_either_way_and_its_rules_count(fitted):
    """Agreement on states that all ask for the same would say little."""
    policy, out = fitted
    actions = column(out, "decision").ravel()
    assert 0.05 < np.mean(actions) < 0.95
    asked = np.argmax(read_policy(policy)[1].logits(inputs(out)), axis=1)
    assert np.any(asked != actions)
    assert np.all(actions[asked != actions] == 1)  # rules keep the coil on


def test_the_code_acts_as_states_csv_says(exported, any_copy):
    done = replay(any_copy, read_policy(exported[0])[1])
    assert done.faithful, done


REPLAY = """
#include <stdio.h>
#include "epv_policy.h"

int main(void)
{
    static epv_policy_memory memory;
    epv_policy_readings now;
    while (fread(&now, sizeof now, 1, stdin) == 1)
        putchar(epv_policy_step(&memory, &now));
    return 0;
}
"""
"""Readings of an episode in, its decisions out."""


def test_nothing_in_it_is_undefined(any_copy, tmp_path):
    options = sanitisers(tmp_path)
    (any_copy / "replay.c").write_text(REPLAY)
    program = build(["cc"], any_copy, *options, "replay.c", "epv_policy.c", "-lm", output="replay")
    decided = []
    for episode in readings(any_copy):
        done = subprocess.run([program], input=episode.tobytes(), capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
        decided += done.stdout
    assert np.mean(decided == column(any_copy, "decision").ravel()) >= 0.9999


@pytest.mark.parametrize(
    ("file", "pattern", "instead"),
    [
        ("epv_policy.c", r"(BIAS_0\[\d+\] = \{\s*)[^,]+,", r"\g<1>3.0f,"),
        ("epv_learner.h", r"10395\.0f\)", "10394.0f)"),
        ("epv_learner.h", r"(OBSERVATION_P2_LAGS\[\d+\] = \{\s*1\.0f, 2\.0f, )4", r"\g<1>3"),
        ("epv_policy.c", r"m->waited = 1;", "m->waited = 0;"),
        ("epv_learner.h", r"/ v->pace\)", "/ (1.02f * v->pace))"),
        ("epv_learner.h", r"v->gain \* fn_gained_at_once", "2.0f * v->gain * fn_gained_at_once"),
    ],
)
def test_a_spoilt_number_is_caught(fitted, copy, file, pattern, instead):
    text, count = re.subn(pattern, instead, (copy / file).read_text())
    assert count
    (copy / file).write_text(text)
    assert not replay(copy, read_policy(fitted[0])[1]).faithful


def test_it_needs_three_functions_and_changes_no_global(any_copy):
    if shutil.which("nm") is None:
        pytest.skip("there is no nm here")
    subprocess.run(["cc", "-std=c99", "-O2", "-c", "epv_policy.c"], cwd=any_copy, check=True)
    listed = subprocess.run(
        ["nm", "-f", "posix", "epv_policy.o"], cwd=any_copy, capture_output=True, text=True, check=True
    ).stdout
    kinds = {line.split()[0]: line.split()[1] for line in listed.splitlines()}
    needed = {name for name, kind in kinds.items() if kind == "U"}
    assert needed <= {"expf", "logf", "sqrtf", "memset", "memcpy", "_GLOBAL_OFFSET_TABLE_"}
    assert set(kinds.values()) <= {"T", "t", "R", "r", "d", "U"}, listed  # no data that changes


def test_tanh_is_good_to_seven_units_in_the_last_place(fitted, tmp_path):
    copied(fitted[1], tmp_path)
    (tmp_path / "tanh.c").write_text(
        '#include "epv_policy.c"\nfloat tanh_of(float x) { return fn_tangent(x); }\n'
    )
    built = build(["cc"], tmp_path, "-shared", "-fPIC", "tanh.c", "-lm", output="tanh.so")
    function = ctypes.CDLL(str(built)).tanh_of
    function.argtypes, function.restype = (ctypes.c_float,), ctypes.c_float
    given = np.r_[np.linspace(-10, 10, 20_000), np.linspace(-1, 1, 20_000)].astype(np.float32)
    found = np.array([function(float(x)) for x in given])
    exact = np.tanh(given.astype(np.float64))
    units = np.abs(found - exact) / np.spacing(np.abs(exact).astype(np.float32))
    assert units.max() <= 7
    assert np.abs(found).max() == 1.0


def test_it_decides_right_when_another_controller_switches_the_coil(fitted, tmp_path):
    """The observation holds what the coil did, not what the policy had wanted."""
    folder, out = fitted
    code = library(["cc"], copied(out, tmp_path))
    along = visit(GOOD, first_seed=5, episodes=8, periods=400)
    wanted = follow(load_policy(folder), along)
    assert np.any(wanted != along.actions)
    assert np.mean(follow(CompiledPolicy(code=code), along) == wanted) >= 0.999


def test_the_controller_behind_the_check_of_p3_takes_over(fitted, tmp_path):
    """With a reading of p3 that stands still the code decides as Python does."""
    folder, out = fitted
    code = library(["cc"], copied(out, tmp_path))
    along = visit(GOOD, first_seed=9, episodes=8, periods=300)
    frozen = along.observations.copy()
    p3 = decode(frozen, "p3")
    p3[:, 100:] = p3[:, 100:101]
    frozen[..., INDEX["p3"]] = (p3 - CENTRE[INDEX["p3"]]) / SCALE[INDEX["p3"]]
    for lag in P3_LAGS:
        before = np.concatenate([np.repeat(p3[:, :1], lag, axis=1), p3[:, :-lag]], axis=1)
        frozen[..., INDEX[f"p3_change_{lag}"]] = (p3 - before) / SCALE[INDEX[f"p3_change_{lag}"]]
    states = replace(along, observations=frozen)
    controller = load_policy(folder)
    wanted = follow(controller, states)
    assert np.any(controller.failed)
    assert np.mean(follow(CompiledPolicy(code=code), states) == wanted) >= 0.999


def test_the_contract_says_what_the_files_hold(exported, tmp_path):
    """The size of the memory in C's own word."""
    policy, out = exported
    content = json.loads((out / "contract.json").read_text())
    assert content["observation"] == json.loads(json.dumps(contract(0.005)))
    weights = sum(weight.size for weight, _ in read_policy(policy)[1].layers)
    assert content["operations"]["multiply_accumulates"] == weights
    assert "#define EPV_POLICY_PERIOD_US 5000" in (out / "epv_policy.h").read_text()
    size = content["bytes"]["memory_of_a_valve"]
    assert size == MEMORY.itemsize
    copied(out, tmp_path)
    (tmp_path / "size.c").write_text(
        f'#include "epv_policy.h"\nchar as_said[sizeof(epv_policy_memory) == {size} ? 1 : -1];\n'
    )
    build(["cc"], tmp_path, "-c", "size.c", output="size.o")


def test_another_export_replaces_it_by_the_same(random, tmp_path):
    policy, out = random
    again = Path(shutil.copytree(out, tmp_path / "again"))
    (again / "epv_policy.c").write_text("spoilt")
    assert export(policy, again) == 0
    for name in FILES - {"epv_policy.fmu"}:
        assert (again / name).read_bytes() == (out / name).read_bytes(), name


def folder_without_weights(tmp_path: Path) -> list[str]:
    policy = random_policy(tmp_path / "policy")
    (policy / "policy.safetensors").unlink()
    return [str(policy)]


def good_but(*more: str):
    return lambda tmp_path: [str(random_policy(tmp_path / "policy")), *more]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (lambda tmp_path: [str(tmp_path / "nowhere")], "cannot read a policy from"),
        (folder_without_weights, "give a folder that training wrote"),
        (good_but("--compiler", "no-such-cc"), "there is no C compiler 'no-such-cc' here"),
        (good_but("--compiler", "false"), "false does not compile the exported code"),
        (good_but("--episodes", "0"), "argument --episodes: 0 must be a whole number"),
        (good_but("--out", "/dev/null/x"), "is not a folder"),
        (good_but("--duration", "0.1"), "0.1 must be a number from 0.55"),
    ],
)
def test_wrong_input_gets_one_sentence_and_leaves_nothing(arguments, words, tmp_path, capsys):
    given = arguments(tmp_path)
    where = [] if "--out" in given else ["--out", str(tmp_path / "ecu")]
    try:
        status = command(*given, *where)
    except SystemExit as left:  # argparse's way
        status = left.code
    said = capsys.readouterr().err
    assert status == 2
    assert words in said
    assert said.strip().count("\n") <= 4  # argparse prints its usage first
    assert not (tmp_path / "ecu").exists()


def test_a_folder_of_other_things_is_left_alone(tmp_path, capsys):
    policy = random_policy(tmp_path / "policy")
    assert export(policy, policy) == 2
    assert "give --out a new or empty folder" in capsys.readouterr().err


def test_a_failed_export_leaves_the_earlier_one(fitted, copy, capsys):
    before = {path.name: path.read_bytes() for path in copy.iterdir()}
    assert export(fitted[0], copy, "--compiler", "false") == 2
    assert {path.name: path.read_bytes() for path in copy.iterdir()} == before
    assert "does not compile" in capsys.readouterr().err


def test_the_task_of_the_guide_compiles(any_copy):
    page = (ROOT / "docs/reference/exported-policy.md").read_text(encoding="utf-8")
    task = re.findall(r"^```c\n(.*?)^```", page, re.S | re.M)[0]
    reads = [f"float {name}(void);\n" for name in re.findall(r"(\w+)\(\)[,;]?", task)]
    (any_copy / "task.c").write_text(
        f"{''.join(reads)}void switch_coil(int on);\nvoid every_5_ms(void);\n{task}"
    )
    build(["cc"], any_copy, "-c", "task.c", output="task.o")
