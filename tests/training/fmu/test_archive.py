"""What lies in an FMU, whether FMPy accepts it, and what the command writes and refuses."""

import importlib.util
import io
import json
import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree as xml

import numpy as np
import pytest

from epv_env.common.commands import main_of
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, save_plant
from tests.training.fmu.unit import OK, Instance, Unit
from training.deploy.compiled import STRICT
from training.deploy.fmu.archive import UnitError, base_units, fmu, fmu_sources, model_description
from training.deploy.fmu.models import plant_model

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler (cc) here")


@pytest.fixture(scope="module")
def model():
    return plant_model(Plant.calibrated())


def run(*words: object) -> int:
    arguments = [str(word) for word in words]
    return main_of("training.commands.export", program="export", arguments=arguments)


def description(path: Path) -> xml.Element:
    with zipfile.ZipFile(path) as archive:
        return xml.fromstring(archive.read("modelDescription.xml"))


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("Pa", {"kg": 1, "m": -1, "s": -2}),
        ("V s/(A m)", {"kg": 1, "m": 1, "s": -2, "A": -2}),  # H/m
        ("N s/m", {"kg": 1, "s": -1}),
        ("1/m^2", {"m": -2}),
        ("K/J", {"K": 1, "kg": -1, "m": -2, "s": 2}),
        ("1", {}),
    ],
)
def test_units_are_powers_of_base_units(unit, powers):
    assert base_units(unit) == powers


def test_an_unknown_unit_is_named():
    with pytest.raises(UnitError, match="'furlong'"):
        base_units("furlong/s")


def test_every_number_with_a_dimension_has_its_unit(model):
    root = xml.fromstring(model_description(model))
    known = {unit.attrib["name"] for unit in root.iter("Unit")}
    units = {
        v.attrib["name"]: real.attrib.get("unit")
        for v in root.iter("ScalarVariable")
        for real in v.iter("Real")
    }
    assert units["p2"] == "Pa"
    assert units["I"] == "A"
    assert units["alphaMV"] is None
    assert {unit for unit in units.values() if unit} == known


@needs_compiler
def test_the_command_writes_a_plant_file(tmp_path):
    plant = Plant(parameters=Parameters.calibrated().replace(R=44.0), region=Plant.calibrated().region)
    save_plant(plant, tmp_path / "plant.json")
    assert run("plant", "--plant", tmp_path / "plant.json", "--out", tmp_path / "out") == 0
    (path,) = (tmp_path / "out").iterdir()
    assert path.name == "epv_plant.fmu"
    instance = Instance(Unit(path.read_bytes(), tmp_path / path.stem)).start()
    assert instance.step(0.1) == OK
    assert instance.get("I") == pytest.approx([24 / 44])


def test_without_a_compiler_the_sources_are_there(tmp_path, capsys):
    assert run("plant", "--out", tmp_path, "--compiler", "no-such-compiler") == 0
    assert "no C compiler" in capsys.readouterr().out
    with zipfile.ZipFile(tmp_path / "epv_plant.fmu") as archive:
        names = set(archive.namelist())
    assert not any(each.startswith("binaries") for each in names)
    assert {"modelDescription.xml", "sources/equations.h"} <= names


def test_the_same_plant_gives_the_same_sources(model):
    content = fmu(model, "")
    assert fmu(plant_model(Plant.calibrated()), "") == content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None


@needs_compiler
def test_the_sources_agree_with_the_standards_header(model, tmp_path):
    """FMPy brings the header; a function of another form than its declaration would not compile."""
    fmpy = importlib.util.find_spec("fmpy")
    if fmpy is None or fmpy.origin is None:
        pytest.skip("FMPy, which has the standard's headers, is not installed")
    for name, text in fmu_sources(model).items():
        (tmp_path / name).write_text(text)
    headers = Path(fmpy.origin).parent / "c-code"
    words = ["-I", str(headers), "-include", "fmi2Functions.h", "-c", "fmi2.c"]
    done = subprocess.run(
        ["cc", *STRICT, *words], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert not done.returncode, done.stderr


@needs_compiler
def test_a_prefix_keeps_linked_units_apart(model, tmp_path):
    for name, text in fmu_sources(model).items():
        (tmp_path / name).write_text(text)
    prefix = "-DFMI2_FUNCTION_PREFIX=valve_"
    command = ["cc", *STRICT, prefix, "-c", "fmi2.c", "-o", "unit.o"]
    subprocess.run(command, cwd=tmp_path, check=True)
    text = (tmp_path / "unit.o").read_bytes()
    assert b"valve_fmi2DoStep" in text


@needs_compiler
def test_fmpy_validates_and_simulates_it(model, tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
    validation = pytest.importorskip("fmpy.validation")
    path = tmp_path / "plant.fmu"
    path.write_bytes(fmu(model, "cc"))
    assert validation.validate_fmu(str(path)) == []
    signal = np.array(
        [(0.0, 0.0, 0.01), (0.1, 0.0, 0.01), (0.1, 24.0, 0.0), (0.2, 24.0, 0.0)],
        dtype=[("time", float), ("U", float), ("sigma_S", float)],
    )
    found = fmpy.simulate_fmu(
        str(path), stop_time=0.2, output_interval=1e-3, input=signal, start_values={"R": 44.0}
    )
    instance = Instance(Unit(path.read_bytes(), tmp_path / "own")).start({"R": 44.0})
    assert instance.step(0.1, U=0.0, sigma_S=0.01) == OK
    assert instance.step(0.1, U=24.0, sigma_S=0.0) == OK
    (p2,) = instance.get("p2")
    assert found["p2"][-1] == pytest.approx(p2, abs=10.0)
    assert found["p2"].min() < 7.5e5


def test_the_description_survives_any_plant_name(tmp_path):
    plant = Plant(
        parameters=Parameters.calibrated(), region=Plant.calibrated().region, name='<&" */ \x00\n'
    )
    save_plant(plant, tmp_path / "plant.json")
    assert json.loads((tmp_path / "plant.json").read_text())
    assert run("plant", "--plant", tmp_path / "plant.json", "--out", tmp_path, "--compiler", "") == 0
    assert "plant" in description(tmp_path / "epv_plant.fmu").attrib["description"]
