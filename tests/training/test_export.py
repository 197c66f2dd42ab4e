"""The exported policy decides as the policy does, wherever it is compiled, and its tests can fail."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("safetensors")

from controllers.hysteresis import Hysteresis
from controllers.learned import load_policy
from epv_env.observation import contract
from epv_env.plant.commandline import fail_clearly
from tests.training.policies import Layers, fitted_layers, random_layers, write_policy
from training.ecu.compiled import CompiledPolicy, build, float_logits, library
from training.ecu.measure import follow
from training.ecu.quantise import FULL, FixedPolicy, quantise
from training.ecu.sources import Export, sources
from training.ecu.states import visit
from training.export import EPISODES, FILES, PERIODS, main
from training.seeds import CALIBRATION_SEED

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

ROOT = Path(__file__).parents[2]
QUICK = ("--episodes", "4", "--duration", "1")
GOOD = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="good")


def export(policy: Path, out: Path, *more: str) -> int:
    return fail_clearly(lambda: main([str(policy), "--out", str(out), *QUICK, *more]))


def export_of(layers: Layers, folder: Path) -> tuple[Path, Path]:
    """Folders of a policy and of its export."""
    policy = write_policy(layers, folder / "policy")
    assert export(policy, folder / "ecu") == 0
    return policy, folder / "ecu"


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
    """Either."""
    return request.getfixturevalue(request.param)


@pytest.fixture
def copy(fitted, tmp_path):
    """An export that a test may spoil."""
    return Path(shutil.copytree(fitted[1], tmp_path / "copy"))


def states(folder: Path) -> np.ndarray:
    return np.genfromtxt(folder / "states.csv", delimiter=",", names=True)


def observations(folder: Path) -> np.ndarray:
    """Observations (10000, entries) of states.csv, as float32."""
    return np.genfromtxt(folder / "states.csv", delimiter=",", skip_header=1)[:, 7:20].astype(np.float32)


def parity(folder: Path, *options: str) -> subprocess.CompletedProcess:
    """Do what the comment of parity.c says, as a stranger would."""
    line = re.search(r"cc .* && \./parity", (folder / "parity.c").read_text())
    assert line is not None
    command = line.group().replace("-O2", " ".join(["-O2", *options]))
    return subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=False)


def test_an_export_is_complete_and_within_its_bars(exported):
    policy, out = exported
    assert {path.name for path in out.iterdir()} == FILES
    report = json.loads((out / "report.json").read_text())
    found = report["agreement"]
    assert found["states"] == found["float_agrees"] == 10_000
    assert found["states_within_rounding"] == 0  # or agreement would be luck
    least = 9_900 if policy.parent.name.startswith("fitted") else 9_700  # a random net hardly decides
    assert found["fixed_agrees"] >= least
    for time in report["microseconds"].values():
        assert time["median_us"] <= time["slowest_state_us"] <= 50
    loop = report["closed_loop"]["controllers"]
    assert loop["float C"] == loop[load_policy(policy).name]


def test_the_states_are_ones_that_the_policy_visits_and_decides(exported):
    policy, out = exported
    actions = states(out)["policy_action"]
    assert len(actions) == 10_000
    np.testing.assert_array_equal(load_policy(policy).act(observations(out)), actions)


def test_the_fitted_policy_decides_either_way(fitted):
    """Agreement on states that all ask for the same would say little."""
    assert 0.05 < np.mean(states(fitted[1])["policy_action"]) < 0.95


def test_a_stranger_s_one_line_confirms_it(exported, tmp_path):
    done = parity(Path(shutil.copytree(exported[1], tmp_path / "copy")))
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("10000 of 10000 decisions") == 2


def test_nothing_in_it_is_undefined(copy, tmp_path):
    options = ("-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    (tmp_path / "empty.c").write_text("int main(void) { return 0; }\n")
    probe = subprocess.run(["cc", *options, tmp_path / "empty.c", "-o", tmp_path / "probe"], check=False)
    if probe.returncode:
        pytest.skip("this compiler has no sanitisers")
    done = parity(copy, *options)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("file", "pattern", "instead"),
    [
        ("epv_float.c", r"(BIAS_0\[\d+\] = \{\s*)[^,]+,", r"\g<1>3.0f,"),
        ("epv_float.c", r"10395\.0f;", "10394.0f;"),
        ("epv_fixed.c", r"(FACTOR_0\[\d+\] = \{\s*)\d+u", r"\g<1>1u"),
        ("epv_float.c", r"change\(m->p2, m->newest, 4\)", "change(m->p2, m->newest, 3)"),
        ("epv_float.c", r"m->waited = 1;", "m->waited = 0;"),
    ],
)
def test_a_spoilt_number_is_caught(copy, file, pattern, instead):
    text, count = re.subn(pattern, instead, (copy / file).read_text())
    assert count
    (copy / file).write_text(text)
    assert parity(copy).returncode == 1


def test_it_needs_no_library_and_changes_no_global(copy):
    if shutil.which("nm") is None:
        pytest.skip("there is no nm here")
    for variant in ("float", "fixed"):
        subprocess.run(["cc", "-std=c99", "-O2", "-c", f"epv_{variant}.c"], cwd=copy, check=True)
        listed = subprocess.run(
            ["nm", "-f", "posix", f"epv_{variant}.o"],
            cwd=copy,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        kinds = {line.split()[1] for line in listed.splitlines()}
        assert kinds <= {"T", "t", "R", "r", "d"}, listed  # code, constants; d: constants with addresses
        assert "malloc" not in (copy / f"epv_{variant}.c").read_text()


def test_onnx_decides_the_same(exported):
    runtime = pytest.importorskip("onnxruntime")
    _, out = exported
    session = runtime.InferenceSession(out / "policy.onnx", providers=["CPUExecutionProvider"])
    logits, actions = session.run(["logits", "action"], {"observation": observations(out)})
    np.testing.assert_array_equal(actions, states(out)["policy_action"])
    assert logits.shape == (10_000, 2)
    assert json.loads(session.get_modelmeta().custom_metadata_map["observation"]) == json.loads(
        json.dumps(contract(0.005))
    )


def test_the_integer_code_is_the_arithmetic_that_is_documented(exported, tmp_path):
    """The same whole numbers from numpy, for every state, to the last bit."""
    policy, out = exported
    code = library(["cc"], copied(out, tmp_path))
    seen = visit(load_policy(policy), first_seed=CALIBRATION_SEED, episodes=EPISODES, periods=PERIODS)
    fixed = quantise(load_policy(policy), seen.flat)
    signal = np.random.default_rng(0).integers(-FULL, FULL, (2000, 13)).astype(np.int16)
    given = np.ascontiguousarray(signal)
    logits = np.empty((len(given), 2), dtype=np.int32)
    for i in range(len(given)):
        code.epv_fixed_logits(given[i].ctypes, logits[i].ctypes)
    np.testing.assert_array_equal(logits, whole_number_logits(fixed, given))


def whole_number_logits(fixed: FixedPolicy, signal: np.ndarray) -> np.ndarray:
    """Logits (n, 2) of observations (n, entries) int16, in 64-bit whole numbers."""
    table = fixed.tangent.astype(np.int64)
    wide = signal.astype(np.int64)
    for k, layer in enumerate(fixed.layers):
        sums = wide @ layer.weight.T.astype(np.int64)
        assert np.abs(sums).max() < 2**31
        scaled = (np.abs(sums) * layer.factor.astype(np.int64) + (1 << (layer.shift - 1))) >> layer.shift
        total = np.sign(sums) * scaled + layer.bias
        if k == len(fixed.layers) - 1:
            return total
        size = np.minimum(np.abs(total), (256 << 11) - 1)
        place, part = size >> 11, size & 2047
        inside = table[place] + (((table[place + 1] - table[place]) * part + 1024) >> 11)
        wide = np.sign(total) * np.where(np.abs(total) >= 256 << 11, FULL, inside)
    raise AssertionError("a policy has layers")


def copied(out: Path, folder: Path) -> Path:
    """The C files of an export, where a library may be built of them."""
    for path in out.glob("epv_*"):
        shutil.copy(path, folder)
    return folder


def test_tanh_is_good_to_seven_units_in_the_last_place(tmp_path):
    """A net of one unit whose logit of on is tanh of the first entry."""
    first, last = np.zeros((1, 13), np.float32), np.array([[0.0], [1.0]], np.float32)
    first[0, 0] = 1.0
    policy = load_policy(
        write_policy([(first, np.zeros(1, "f4")), (last, np.zeros(2, "f4"))], tmp_path / "policy")
    )
    given = np.zeros((40_000, 13), np.float32)
    given[:, 0] = np.concatenate([np.linspace(-10, 10, 20_000), np.linspace(-1, 1, 20_000)])
    export = Export(policy=policy, fixed=quantise(policy, given), period=0.005, weights_sha256="none")
    for name, text in sources(export).items():
        (tmp_path / name).write_text(text)
    found = float_logits(library(["cc"], tmp_path), given)[:, 1].astype(np.float64)
    exact = np.tanh(given[:, 0].astype(np.float64))
    units = np.abs(found - exact) / np.spacing(np.abs(exact).astype(np.float32))
    assert units.max() <= 7
    assert np.abs(found).max() == 1.0


def test_it_decides_right_when_another_controller_switches_the_coil(fitted, tmp_path):
    """The observation holds what the coil did, not what the policy had wanted."""
    policy, out = fitted
    code = library(["cc"], copied(out, tmp_path))
    along = visit(GOOD, first_seed=5, episodes=8, periods=400)
    wanted = load_policy(policy).act(along.flat).reshape(along.actions.shape)
    assert np.any(wanted != along.actions)
    np.testing.assert_array_equal(follow(CompiledPolicy(code=code, variant="float"), along), wanted)
    assert np.mean(follow(CompiledPolicy(code=code, variant="fixed"), along) == wanted) > 0.98


def test_a_reading_that_is_not_a_number_shuts_the_valve(fitted, tmp_path):
    code = library(["cc"], copied(fitted[1], tmp_path))
    for entry in range(13):
        given = np.zeros(13, np.float32)
        given[entry] = np.nan
        assert code.epv_float_decide(given.ctypes) == 1


def test_the_contract_says_what_the_files_hold(exported):
    policy, out = exported
    content = json.loads((out / "contract.json").read_text())
    assert content["observation"] == json.loads(json.dumps(contract(0.005)))
    for variant in content["variants"].values():
        assert set(variant["files"]) <= FILES
    weights = sum(weight.size for weight, _ in load_policy(policy).layers)
    for name in ("float", "fixed"):
        assert content["variants"][name]["operations"]["multiply_accumulates"] == weights
        assert f"#define EPV_{name.upper()}_PERIOD_US 5000" in (out / f"epv_{name}.h").read_text()


def test_another_export_replaces_it_by_the_same(random, tmp_path):
    policy, out = random
    again = Path(shutil.copytree(out, tmp_path / "again"))
    (again / "epv_float.c").write_text("spoilt")
    assert export(policy, again) == 0
    assert {path.name for path in again.iterdir()} == FILES
    for name in FILES - {"report.json"}:  # which holds times
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
        (weights_not_finite, "weights that are not finite"),
        (three_actions, "only decisions between off and on"),
        (good_but("--compiler", "no-such-cc"), "there is no C compiler 'no-such-cc' here"),
        (good_but("--compiler", "false"), "false does not compile the exported code"),
        (good_but("--episodes", "0"), "--episodes must be positive"),
        (good_but("--out", "/dev/null/x"), "is not a folder"),
    ],
)
def test_wrong_input_gets_one_sentence_and_leaves_nothing(arguments, words, tmp_path, capsys):
    given = arguments(tmp_path)
    where = [] if "--out" in given else ["--out", str(tmp_path / "ecu")]
    try:
        status = fail_clearly(lambda: main([*given, *where]))
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


def test_the_task_of_the_guide_compiles(copy):
    page = (ROOT / "docs/deploy.md").read_text(encoding="utf-8")
    task = re.findall(r"^```c\n(.*?)^```", page, re.S | re.M)[0]
    reads = [f"float {name}(void);\n" for name in re.findall(r"(\w+)\(\)[,;]?", task)]
    (copy / "task.c").write_text(
        f"{''.join(reads)}void switch_coil(int on);\nvoid every_5_ms(void);\n{task}"
    )
    build(["cc"], copy, "-c", "task.c", output="task.o")


def test_the_command_runs_as_it_is_documented():
    script = ROOT / "training/export.py"
    done = subprocess.run(
        [sys.executable, script, "--help"], capture_output=True, text=True, check=True, timeout=120
    )
    assert "electronic control unit" in done.stdout
