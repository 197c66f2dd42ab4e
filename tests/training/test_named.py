"""Controllers by name: registered ones, policies, and classes of one's own."""

from pathlib import Path

import pytest

import docs.examples.relay
from epv_env.plant.plantfile import Plant
from training.evaluation.named import is_import, named_controllers
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()
README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
RELAY = Path(docs.examples.relay.__file__).read_text()
FAULTY = """
class NeedsArguments:
    def __init__(self, low):
        self.low = low

class Lacks:
    name, environment = "lacks", "EPValve-v0"

class Elsewhere:
    name, environment = "elsewhere", "CartPole-v1"
    def reset(self, n): ...
    def act(self, observations): ...

class Raises:
    def __init__(self):
        raise RuntimeError("two\\nlines")

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
    controllers, digests = named_controllers(["my_relay:Relay", "informed pulse"], PLANT)
    assert list(controllers) == list(digests) == ["relay", "informed pulse"]
    metrics = run_episodes(controllers["relay"], seeds=[0, 1], duration=1.0, options={})
    assert metrics.switchings_per_s.min() > 0


def test_a_changed_module_is_another_controller(folder):
    digests = []
    for module, text in (("one", RELAY), ("two", RELAY.replace('"p2_error") >', '"p2_error") >='))):
        (folder / f"{module}.py").write_text(text)
        digests += named_controllers([f"{module}:Relay"], PLANT)[1].values()
    assert digests[0] != digests[1]
    assert list(named_controllers(["one:Relay"], PLANT)[1].values()) == digests[:1]


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("nobody", "no controller 'nobody': give PPO, hysteresis, extrapolating hysteresis, PWM, adap"),
        ("nowhere:Relay", "No module named 'nowhere': give MODULE:CLASS of a module in"),
        ("faulty:Relay", "module faulty has no class Relay"),
        ("faulty:SOMETHING", "module faulty has no class SOMETHING"),
        ("faulty:NeedsArguments", "missing 1 required positional argument: 'low': give every argument"),
        ("faulty:Elsewhere", "acts in the environment 'CartPole-v1': give a text and one of EPValve-v0"),
        ("faulty:Raises", "RuntimeError: two lines .*faulty.py, line 16"),
        ("unreadable:Relay", "SyntaxError: .*correct the module"),
        ("raising:Relay", "ZeroDivisionError: .*raising.py, line 1.: correct the module"),
        ("math:Relay", "module math has no class Relay"),
        ("faulty:Lacks", "lacks reset, act: controllers/base.py has the protocol"),
    ],
)
def test_what_is_no_controller_is_refused(folder, source, message):
    for name, text in (("faulty", FAULTY), ("unreadable", "class"), ("raising", "1 / 0")):
        (folder / f"{name}.py").write_text(text)
    with pytest.raises(ValueError, match=message):
        named_controllers([source], PLANT)


def test_every_name_of_the_table_is_a_controller():
    """Names have no commas, so that a list of them can be read."""
    rows = README.split("| controller |")[1].partition("<!-- end")[0].splitlines()[2:]
    names = [row.split("|")[1].strip() for row in rows]
    assert len(names) == 5
    assert list(named_controllers(names, PLANT)[0]) == names
    assert not any("," in name for name in names)


@pytest.mark.parametrize(
    ("source", "imports"),
    [("a.b:C", True), ("a:C", True), ("a", False), ("C:/a", False), ("x=/p:C", False), (":C", False)],
)
def test_an_import_is_told_from_a_folder(source, imports):
    assert is_import(source) == imports


def test_two_controllers_of_one_label_are_refused():
    with pytest.raises(ValueError, match="two controllers are called 'hysteresis'"):
        named_controllers(["hysteresis", "hysteresis"], PLANT)
