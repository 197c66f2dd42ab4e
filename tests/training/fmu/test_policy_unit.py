"""The FMU of an exported policy decides as the policy, and closes the loop with the plant's FMU."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("safetensors")

from controllers.learned import TRAINED
from epv_env.plant.plantfile import Plant
from tests.training.exports import PERIODS, column, export, recurrent_export
from tests.training.fmu.unit import OK, Instance, Unit
from training.deploy.fmu.files import VERSIONS, fmu
from training.deploy.fmu.plant_model import plant_model
from training.deploy.fmu.policy_model import policy_model
from training.deploy.quantisation import ExportError

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

PERIOD = 5e-3
HALF_A_BAR = 5e4


@pytest.fixture(scope="module")
def ecu(tmp_path_factory) -> Path:
    """The export of a policy that comes with the package."""
    folder = tmp_path_factory.mktemp("policy") / "ecu"
    assert export(TRAINED / "plain" / "seed-0", folder) == 0
    return folder


def units_of(folder: Path, where: Path) -> list[Unit]:
    return [Unit(fmu(policy_model(folder), each, "cc"), where / each) for each in VERSIONS]


def readings(folder: Path, episode: int) -> list[dict[str, float]]:
    """Inputs of the unit in each period of an episode of states.csv."""
    names = {"p1": 1e5, "p2": 1e5, "p3": 1e5, "target": 1e5, "current": 1.0}
    header = (folder / "states.csv").read_text().splitlines()[0].split(",")
    columns = {name: next(each for each in header if each.startswith(name)) for name in names}
    table = {name: scale * column(folder, columns[name])[episode] for name, scale in names.items()}
    table["p2_target"], table["I"] = table.pop("target"), table.pop("current")
    return [{name: float(values[k]) for name, values in table.items()} for k in range(PERIODS)]


def decisions(unit: Unit, inputs: list[dict[str, float]]) -> list[float]:
    """What the unit decides in each period: the first at its start, the next when a step begins."""
    instance = Instance(unit).start(inputs[0])
    found = instance.get("coil")
    assert instance.step(PERIOD) == OK
    for each in inputs[1:]:
        assert instance.step(PERIOD, **each) == OK
        found += instance.get("coil")
    return found


@pytest.mark.parametrize("version", [0, 1])
def test_it_decides_as_the_policy_on_visited_states(ecu, tmp_path, version):
    unit = units_of(ecu, tmp_path)[version]
    actions = column(ecu, "policy_action")
    for episode in range(3):
        assert decisions(unit, readings(ecu, episode)) == list(actions[episode])


def test_so_does_a_policy_with_a_memory(tmp_path):
    _, folder = recurrent_export(tmp_path)
    found = decisions(units_of(folder, tmp_path)[1], readings(folder, 0))
    assert found == list(column(folder, "policy_action")[0])


def test_the_loop_of_both_units_holds_the_pressure(ecu, tmp_path):
    """Communication steps of 1 ms under braking: p2 stays within 0.5 bar of its target."""
    plant = Instance(Unit(fmu(plant_model(Plant.calibrated()), "3.0", "cc"), tmp_path / "plant")).start()
    policy = Instance(units_of(ecu, tmp_path)[1]).start()
    pressures = []
    for k in range(1000):
        (U,) = policy.get("U")
        assert plant.step(1e-3, U=U, sigma_S=0.004 if k % 500 < 250 else 0.0) == OK
        p1, p2, p3, current = plant.get("p1", "p2", "p3", "I")
        assert policy.step(1e-3, p1=p1, p2=p2, p3=p3, I=current, p2_target=8e5) == OK
        pressures.append(p2)
    assert np.abs(np.array(pressures) - 8e5).max() < HALF_A_BAR
    assert np.ptp(pressures) > 1e3


def test_the_voltage_of_a_decision_is_a_parameter(ecu, tmp_path):
    instance = Instance(units_of(ecu, tmp_path)[0]).start({"U_on": 12.0, "p2": 12e5})
    assert instance.get("coil", "U") == [1.0, 12.0]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("{", "is not JSON"),
        ("[" * 100_000, "is not JSON"),
        ('{"format": "other/1"}', "has format 'other/1'"),
        ('{"format": "epv-deployment/1"}', "field 'observation' is missing"),
        ('{"format": "epv-deployment/1", "observation": {"control_period_s": 0}}', "no control period"),
        (
            '{"format": "epv-deployment/1", "observation": {"control_period_s": NaN}}',
            "NaN is no number",
        ),
    ],
)
def test_a_damaged_export_is_refused(ecu, tmp_path, content, sentence):
    folder = tmp_path / "ecu"
    shutil.copytree(ecu, folder)
    (folder / "contract.json").write_text(content)
    with pytest.raises(ExportError, match=sentence):
        policy_model(folder)


def test_code_that_does_not_compile_is_refused(ecu, tmp_path):
    folder = tmp_path / "ecu"
    shutil.copytree(ecu, folder)
    (folder / "epv_float.c").write_text("int")
    with pytest.raises(ExportError, match="does not compile"):
        fmu(policy_model(folder), "2.0", "cc")


def test_the_period_is_the_exports(ecu):
    period = json.loads((ecu / "contract.json").read_text())["observation"]["control_period_s"]
    assert policy_model(ecu).step == period / 5
