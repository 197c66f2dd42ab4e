"""The exported policy decides as the policy does, wherever it is compiled, and its tests can fail."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("safetensors")

from controllers.learned import load_policy
from epv_env.observation import contract
from tests.training.exports import (
    GOOD,
    column,
    command,
    copied,
    export,
    export_of,
    observations,
    parity,
    parity_with,
)
from tests.training.policies import fitted_layers, random_layers, write_policy
from training.commands.export import FILES
from training.deploy.agreement import visit
from training.deploy.c_code import MEMORY, Export, sources
from training.deploy.compiled import CompiledPolicy, build, library, logits_of

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A policy that acts like a good controller, and its export."""
    return export_of(fitted_layers(GOOD, seed=1), tmp_path_factory.mktemp("fitted"))


@pytest.fixture(scope="module")
def random(tmp_path_factory):
    """A policy that means nothing, of another shape, and its export."""
    return export_of(random_layers(seed=2), tmp_path_factory.mktemp("random"))


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
    policy, out = exported
    assert {path.name for path in out.iterdir()} == FILES - {"epv_policy.fmu"}
    report = json.loads((out / "report.json").read_text())
    found = report["agreement"]
    assert found["states"] == found["agrees"] == 10_000
    rounding = found["rounding_of_c"] + found["rounding_of_python"]
    assert found["least_margin"] > rounding  # or agreement would be luck
    time = report["microseconds"]
    assert time["median_us"] <= time["slowest_state_us"] <= 50
    loop = report["closed_loop"]["controllers"]
    assert loop["C"] == loop[load_policy(policy).name]


def test_the_states_are_ones_that_the_policy_visits_and_decides(exported):
    policy, out = exported
    actions = column(out, "policy_action")
    assert actions.size == 10_000
    seen = observations(out)
    decided = load_policy(policy).act(seen.reshape(-1, seen.shape[-1])).reshape(actions.shape)
    np.testing.assert_array_equal(decided, actions)


def test_the_fitted_policy_decides_either_way(fitted):
    """Agreement on states that all ask for the same would say little."""
    assert 0.05 < np.mean(column(fitted[1], "policy_action")) < 0.95


def test_a_stranger_s_one_line_confirms_it(any_copy):
    done = parity(any_copy)
    assert done.returncode == 0, done.stderr
    assert "10000 of 10000 decisions" in done.stdout


def test_nothing_in_it_is_undefined(any_copy, tmp_path):
    options = ("-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    (tmp_path / "empty.c").write_text("int main(void) { return 0; }\n")
    probe = subprocess.run(["cc", *options, tmp_path / "empty.c", "-o", tmp_path / "probe"], check=False)
    if probe.returncode:
        pytest.skip("this compiler has no sanitisers")
    done = parity(any_copy, *options)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("file", "pattern", "instead"),
    [
        ("epv_policy.c", r"(BIAS_0\[\d+\] = \{\s*)[^,]+,", r"\g<1>3.0f,"),
        ("epv_policy.c", r"10395\.0f;", "10394.0f;"),
        ("epv_policy.c", r"change\(m->p2, m->newest, 4\)", "change(m->p2, m->newest, 3)"),
        ("epv_policy.c", r"m->waited = 1;", "m->waited = 0;"),
    ],
)
def test_a_spoilt_number_is_caught(copy, file, pattern, instead):
    assert parity_with(copy, file, pattern, instead) == 1


def test_it_needs_no_library_and_changes_no_global(any_copy):
    if shutil.which("nm") is None:
        pytest.skip("there is no nm here")
    subprocess.run(["cc", "-std=c99", "-O2", "-c", "epv_policy.c"], cwd=any_copy, check=True)
    listed = subprocess.run(
        ["nm", "-f", "posix", "epv_policy.o"], cwd=any_copy, capture_output=True, text=True, check=True
    ).stdout
    kinds = {line.split()[1] for line in listed.splitlines()}
    assert kinds <= {"T", "t", "R", "r", "d"}, listed  # code, constants; d: constants with addresses


def test_onnx_decides_the_same(exported):
    runtime = pytest.importorskip("onnxruntime")
    policy, out = exported
    session = runtime.InferenceSession(out / "policy.onnx", providers=["CPUExecutionProvider"])
    seen = observations(out)
    seen = seen.reshape(-1, seen.shape[-1])
    logits, action = session.run(["logits", "action"], {"observation": seen})
    np.testing.assert_array_equal(action, column(out, "policy_action").ravel())
    np.testing.assert_allclose(logits, load_policy(policy).logits(seen), atol=1e-4)
    assert json.loads(session.get_modelmeta().custom_metadata_map["observation"]) == json.loads(
        json.dumps(contract(0.005))
    )


def test_tanh_is_good_to_seven_units_in_the_last_place(tmp_path):
    """A net of one unit whose logit of on is tanh of the first entry."""
    first, last = np.zeros((1, 13), np.float32), np.array([[0.0], [1.0]], np.float32)
    first[0, 0] = 1.0
    policy = load_policy(
        write_policy([(first, np.zeros(1, "f4")), (last, np.zeros(2, "f4"))], tmp_path / "policy")
    )
    given = np.zeros((40_000, 13), np.float32)
    given[:, 0] = np.concatenate([np.linspace(-10, 10, 20_000), np.linspace(-1, 1, 20_000)])
    export = Export(policy=policy, period=0.005, weights_sha256="none", provenance={})
    for name, text in sources(export).items():
        (tmp_path / name).write_text(text)
    found = logits_of(library(["cc"], tmp_path), given)[:, 1].astype(np.float64)
    exact = np.tanh(given[:, 0].astype(np.float64))
    units = np.abs(found - exact) / np.spacing(np.abs(exact).astype(np.float32))
    assert units.max() <= 7
    assert np.abs(found).max() == 1.0


def follow(controller, states):
    """Decisions (episodes, periods) of a controller along the states that another one visited."""
    controller.reset(len(states.observations))
    periods = range(states.observations.shape[1])
    return np.stack([controller.act(states.observations[:, k]) for k in periods], axis=1)


def test_it_decides_right_when_another_controller_switches_the_coil(fitted, tmp_path):
    """The observation holds what the coil did, not what the policy had wanted."""
    folder, out = fitted
    code = library(["cc"], copied(out, tmp_path))
    along = visit(GOOD, first_seed=5, episodes=8, periods=400)
    wanted = follow(load_policy(folder), along)
    assert np.any(wanted != along.actions)
    np.testing.assert_array_equal(follow(CompiledPolicy(code=code), along), wanted)


def test_a_reading_that_is_not_a_number_shuts_the_valve(exported, tmp_path):
    code = library(["cc"], copied(exported[1], tmp_path))
    for entry in range(13):
        given = np.zeros(13, np.float32)
        given[entry] = np.nan
        assert code.epv_policy_decide(given.ctypes) == 1


def test_the_contract_says_what_the_files_hold(exported, tmp_path):
    """The size of the memory in C's own word."""
    policy, out = exported
    content = json.loads((out / "contract.json").read_text())
    assert content["observation"] == json.loads(json.dumps(contract(0.005)))
    weights = sum(weight.size for weight, _ in load_policy(policy).layers)
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
    for name in FILES - {"report.json", "epv_policy.fmu"}:  # the first holds times
        assert (again / name).read_bytes() == (out / name).read_bytes(), name


def folder_without_weights(tmp_path: Path) -> list[str]:
    write_policy(random_layers(seed=0), tmp_path / "policy")
    (tmp_path / "policy" / "policy.safetensors").unlink()
    return [str(tmp_path / "policy")]


def weights_not_finite(tmp_path: Path) -> list[str]:
    layers = random_layers(seed=0)
    layers[0][0][0, 0] = np.nan
    return [str(write_policy(layers, tmp_path / "policy"))]


def three_actions(tmp_path: Path) -> list[str]:
    layers = random_layers(seed=0, outputs=3)
    return [str(write_policy(layers, tmp_path / "policy"))]


def good_but(*more: str):
    return lambda tmp_path: [str(write_policy(random_layers(seed=0), tmp_path / "policy")), *more]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (lambda tmp_path: [str(tmp_path / "nowhere")], "cannot read a policy from"),
        (folder_without_weights, "give a folder that training wrote"),
        (weights_not_finite, "values that are not finite"),
        (three_actions, "decides between off and on"),
        (good_but("--compiler", "no-such-cc"), "there is no C compiler 'no-such-cc' here"),
        (good_but("--compiler", "false"), "false does not compile the exported code"),
        (good_but("--episodes", "0"), "argument --episodes: 0 must be a whole number"),
        (good_but("--out", "/dev/null/x"), "is not a folder"),
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
    policy = write_policy(random_layers(seed=0), tmp_path / "policy")
    assert export(policy, policy) == 2
    assert "give --out a new or empty folder" in capsys.readouterr().err


def test_a_failed_export_leaves_the_earlier_one(fitted, copy, capsys):
    before = {path.name: path.read_bytes() for path in copy.iterdir()}
    assert export(fitted[0], copy, "--compiler", "false") == 2
    assert {path.name: path.read_bytes() for path in copy.iterdir()} == before
    assert "does not compile" in capsys.readouterr().err


def test_the_task_of_the_guide_compiles(any_copy):
    page = (ROOT / "docs/how-to/deploy-a-policy.md").read_text(encoding="utf-8")
    task = re.findall(r"^```c\n(.*?)^```", page, re.S | re.M)[0]
    reads = [f"float {name}(void);\n" for name in re.findall(r"(\w+)\(\)[,;]?", task)]
    (any_copy / "task.c").write_text(
        f"{''.join(reads)}void switch_coil(int on);\nvoid every_5_ms(void);\n{task}"
    )
    build(["cc"], any_copy, "-c", "task.c", output="task.o")
