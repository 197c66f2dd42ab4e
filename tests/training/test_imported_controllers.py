"""A controller of one's own runs on the command lines; what is none is refused in a sentence."""

from pathlib import Path

import pytest

import docs.examples.relay
from controllers.p3_check import P3Check
from controllers.supervisor import Supervisor
from epv_env.plant.plantfile import Plant
from training import compare
from training.evaluation.rollout import run_episodes
from training.studies.fingerprint import fingerprint
from training.studies.imported_controllers import imported_controller, is_import
from training.studies.named_controllers import named_controllers

pytestmark = pytest.mark.training

RELAY = Path(docs.examples.relay.__file__).read_text()
FAULTY = """
class NeedsArguments:
    def __init__(self, low):
        self.low = low

class Lacks:
    name, environment = "lacks", "EPValve-v0"

SOMETHING = 3
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder, empty, whose modules can be imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_module_of_the_working_folder_controls_valves(folder):
    (folder / "my_relay.py").write_text(RELAY)
    controllers, digests = named_controllers(["my_relay:Relay"], Plant.calibrated())
    assert list(controllers) == list(digests) == ["relay"]
    metrics, _ = run_episodes(controllers["relay"], seeds=[0, 1], duration=1.0, options={})
    assert metrics.switchings_per_s.min() > 0


def test_a_changed_module_is_another_controller(folder):
    digests = []
    for module, text in (("one", RELAY), ("two", RELAY.replace('"p2_error") >', '"p2_error") >='))):
        (folder / f"{module}.py").write_text(text)
        digests.append(fingerprint(imported_controller(f"{module}:Relay")))
    assert digests[0] != digests[1]
    assert fingerprint(imported_controller("one:Relay")) == digests[0]


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("nowhere:Relay", "No module named 'nowhere': give MODULE:CLASS of a module in"),
        ("faulty:Relay", "faulty.py has no class Relay"),
        ("faulty:SOMETHING", "faulty.py has no class SOMETHING"),
        ("faulty:NeedsArguments", "missing 1 required positional argument: 'low': give every argument"),
        ("faulty:Lacks", "lacks reset, act: controllers/base.py has the protocol"),
    ],
)
def test_what_is_no_controller_is_refused(folder, source, message):
    (folder / "faulty.py").write_text(FAULTY)
    with pytest.raises(ValueError, match=message):
        imported_controller(source)


@pytest.mark.parametrize(
    ("source", "imports"),
    [("a.b:C", True), ("a:C", True), ("a", False), ("C:/a", False), ("x=/p:C", False), (":C", False)],
)
def test_an_import_is_told_from_a_folder(source, imports):
    assert is_import(source) == imports


def test_the_comparison_takes_it_beside_the_registered_ones(folder):
    chosen = compare.parse(["--quick", "--controllers", "docs.examples.relay:Relay"])
    names = [contender.name for contender in compare.contenders(chosen)]
    assert names[0] == "relay"
    assert {"hysteresis", "oracle"} < set(names)
    twice = compare.parse(["--quick", "--controllers", *["docs.examples.relay:Relay"] * 2])
    with pytest.raises(ValueError, match="two controllers are called 'relay'"):
        compare.contenders(twice)


@pytest.mark.parametrize(
    "arguments", [["--controllers", "relay"], ["--seed", "-1"], ["--seed", "999999"]]
)
def test_wrong_options_are_refused(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        compare.parse(arguments)
    assert stop.value.code == 2
    assert arguments[0] in capsys.readouterr().err


def test_a_name_may_ask_for_a_supervisor(folder):
    (folder / "my_relay.py").write_text(RELAY)
    sources = ["my_relay:Relay", "supervised:my_relay:Relay"]
    controllers, digests = named_controllers(sources, Plant.calibrated())
    plain, watched = controllers.values()
    assert isinstance(watched, P3Check)
    assert isinstance(watched.main, Supervisor)
    assert watched.name == f"{plain.name}, supervised"
    assert len(set(digests.values())) == 2


def test_a_controller_that_cannot_be_supervised_is_refused():
    with pytest.raises(ValueError, match="give a controller for EPValve-v0"):
        named_controllers(["supervised:PWM"], Plant.calibrated())
