"""Simulators of one candidate at a time: a function, and an FMU."""

import shutil
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from docs.examples.tank import Tank, levels, readings, virtual_recordings
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.simulate import energised, simulate
from identification.gap.black_box_plant import BlackBoxPlant, FmuSimulator
from identification.gap.diagnosis import diagnose
from identification.gap.fit.gaps import WHOLE
from identification.gap.plant import Channel, FreeParameter, NuisanceParameter, PlantError, Run
from identification.gap.plant_checks import check
from identification.gap.prepare import sensor_faults
from identification.gap.prepare.sensor_faults import reading_faults
from identification.gap.report.gap_json import as_json
from identification.gap.report.page import sections
from identification.report.page import Table
from tests.identification.gap.ode_plants import quiet_run
from training.deploy.fmu.archive import fmu
from training.deploy.fmu.models import P1_START, P2_START, U_START, plant_model

TANK = Tank(virtual_recordings({"c": 0.021, "leak": 4e-3}))


def one_tank(values: Mapping[str, float], run: Run) -> NDArray:
    """Level of one tank, (1, samples) [m]; a tank cannot leak backwards."""
    if values["leak"] < 0:
        raise FloatingPointError("the leak is negative")
    arrays = {symbol: np.array([value]) for symbol, value in values.items()}
    period = float(run.time[1] - run.time[0])
    return readings(arrays, levels(arrays, run.inputs["q"], period), period).T


def black_box(simulate=one_tank, **changes) -> BlackBoxPlant:
    """The leaking tank, whose equation is not known."""
    members = {
        "channels": TANK.channels,
        "runs": TANK.runs,
        "parameters": TANK.parameters,
        "causes": TANK.causes,
        "run_offsets": TANK.run_offsets,
    }
    return BlackBoxPlant(simulate, **{**members, **changes})


VALUES = {"c": np.array([0.02, 0.03]), "start": np.array([[0.0, 0.1, 0.2], [0.2, 0.1, 0.0]])}


def test_candidates_and_runs_keep_their_places():
    plant = black_box()
    for run, outputs in zip((2, 0), plant.outputs(VALUES, [2, 0]), strict=True):
        assert outputs.shape == (1, 240, 2)
        for i in range(2):
            values = {"c": VALUES["c"][[i]], "start": VALUES["start"][i, [run]]}
            (expected,) = TANK.outputs(values, [run])
            np.testing.assert_allclose(outputs[..., [i]], expected)


def test_a_pool_gives_the_same_outputs():
    with ProcessPoolExecutor(2) as executor:
        found = black_box(executor=executor).outputs(VALUES, [0, 1])
    np.testing.assert_array_equal(found, black_box().outputs(VALUES, [0, 1]))


def test_the_function_sees_every_symbol():
    seen = {}

    def watched(values, run):
        seen.update(values)
        return one_tank(values, run)

    width = NuisanceParameter(symbol="width", sd=0.1, centre=2.0, step=0.1)
    black_box(watched, tolerances=(width,)).outputs({"c": np.array([0.03])}, [0])
    expected = {"c": 0.03, "leak": 0.0, "lag": 0.0, "evaporation": 0.0}
    assert seen == {**expected, "start": 0.0, "zero": 0.0, "width": 2.0}


def test_a_candidate_that_fails_is_nan_and_leaves_the_others():
    (outputs,) = black_box().outputs({"leak": np.array([-1.0, 0.0])}, [0])
    assert np.all(np.isnan(outputs[..., 0]))
    assert np.all(np.isfinite(outputs[..., 1]))


def test_outputs_of_another_shape_are_named():
    plant = black_box(lambda values, run: one_tank(values, run)[0])
    with pytest.raises(PlantError, match=r"run test_1: the simulator returns the shape \(240,\), not"):
        check(plant)


def test_a_plant_without_equations_is_diagnosed():
    """The leaking tank, without its equation, with unknown noise and a catalogue of two."""
    channel = replace(TANK.channels[0], noise=None)
    diagnosed = diagnose(black_box(channels=(channel,), causes=TANK.causes[:2]))
    assert diagnosed.conclusion.verdict == "known"
    best = diagnosed.conclusion.ambiguity_set[0].hypothesis
    assert best.labels == ("leak",)
    assert diagnosed.ranking.problem.values(best.estimate)["leak"] == pytest.approx(4e-3, rel=0.15)


def test_sensors_and_clock_are_the_places_of_the_gap_and_the_whole_recording_its_regime():
    """No equations, states or regimes are known; the sensor lags."""
    found = diagnose(black_box(runs=Tank(virtual_recordings({"c": 0.021, "lag": 5.0})).runs))
    where = found.localisation
    assert where.likeliest.equation.name == "reading h"
    assert where.missing_term is None
    assert sum(where.equation_probabilities.values()) + where.nothing_missing == pytest.approx(1)
    (gap,) = where.regime_gaps
    assert (gap.channel, gap.regime) == ("h", WHOLE)
    assert gap.gap > 2
    tables = [b for s in sections(found) for b in s.blocks if isinstance(b, Table)]
    assert WHOLE.replace("_", " ") in [row[0] for each in tables for row in each.rows]
    assert list(as_json(found)["where"]["equation"]) == ["reading h", "timing"]


def test_recordings_shorter_than_the_longest_delay_are_examined(monkeypatch):
    monkeypatch.setattr(sensor_faults, "DELAYS", (1, 300))
    for fault in reading_faults(black_box(), {"c": np.array([0.02])}, [0]):
        assert np.all(np.isfinite(fault.changes[0]))


def test_an_fmu_without_fmpy_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "fmpy", None)
    with pytest.raises(ImportError, match=r"an FMU needs FMPy.*pip install -e '.\[fmu\]'"):
        FmuSimulator(tmp_path / "tank.fmu", {}, ["h"], {})


@pytest.fixture(scope="module")
def valve_fmu(tmp_path_factory) -> Path:
    """The valve as an FMU."""
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    if shutil.which("cc") is None:
        pytest.skip("no C compiler for an FMU of this machine")
    path = tmp_path_factory.mktemp("fmu") / "valve.fmu"
    path.write_bytes(fmu(plant_model(Plant.calibrated()), "cc"))
    return path


def test_an_fmu_simulates_the_valve_as_the_kernel_and_what_it_refuses_is_nan(valve_fmu):
    p, U = Parameters.calibrated(), np.repeat([0.0, 24.0, 0.0], 100)
    run = quiet_run(1e-3, len(U), U=U)
    plant = BlackBoxPlant(
        FmuSimulator(valve_fmu, {"U": "U"}, ["p2"], {"R": "R"}, lambda run: {"I_start": 0.5}),
        channels=[Channel(name="p2", unit="bar", scale=1e5, noise=1e3)],
        runs=[run],
        parameters=[FreeParameter(symbol="R", unit="Ohm", low=35.0, high=50.0, nominal=42.0)],
    )
    (found,) = plant.outputs({"R": np.array([p["R"], 50.0, 4.0])}, [0])
    start = energised(p, p1=P1_START, p2=P2_START, U=U_START)._replace(I=0.5)
    expected = simulate(p, initial=start, U=U, period=1e-3).state.p2
    np.testing.assert_allclose(found[0, :, 0], expected, atol=50.0)
    assert np.max(np.abs(found[0, :, 1] - expected)) > 500.0
    assert np.all(np.isnan(found[..., 2]))


def test_a_variable_that_the_fmu_lacks_and_a_file_that_is_none_are_named(valve_fmu, tmp_path):
    with pytest.raises(ValueError, match="the FMU has no variable depth: take names from its modelDesc"):
        FmuSimulator(valve_fmu, {}, ["depth"], {"R": "R"})
    path = tmp_path / "broken.fmu"
    path.write_text("nothing")
    with pytest.raises(ValueError, match=r"broken.fmu cannot be read as an FMU: .*: export it again"):
        FmuSimulator(path, {}, ["p2"], {})
