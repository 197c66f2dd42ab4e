"""The fits of docs/scripts/component_data recover what is known, and its page gives what they find."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from docs.scripts.component_data import chambers, friction, solenoids
from docs.scripts.component_data.component_results import component_results

ROOT = Path(__file__).parents[1]
MEASURED = ROOT.parent / "shared/measured"


def synthetic_run(sliding: float, excess: float, droop: float) -> tuple[np.ndarray, ...]:
    """Ten strokes at 10 mm/s under a regulator that droops; break-away before the first, none after."""
    time = np.arange(0, 43.2, 0.01)
    moving = np.clip(time - 0.2, 0, None)
    position = 0.02 - 0.02 * 2 / np.pi * np.arcsin(np.cos(np.pi * moving / 4.0))
    direction = np.where(np.diff(position, append=position[-1]) >= 0, 1.0, -1.0)
    pressure = 5e5 + droop / 2 * direction
    peak = np.exp(-(((time - 0.21) / 0.01) ** 2))
    friction = sliding * direction * (1 + excess * peak)
    return time, position, pressure, pressure * np.pi / 4 * 0.0257**2 + friction + 1.5


def test_a_known_friction_is_found_under_a_drooping_regulator():
    loop = friction.friction_loop(*synthetic_run(7.0, 0.8, 0.15e5), bore=0.0257)
    assert loop.mean == pytest.approx(7.0, rel=1e-6)
    assert loop.raw == pytest.approx(7.0 + 0.15e5 / 2 * np.pi / 4 * 0.0257**2, rel=1e-6)
    assert loop.first_excess == pytest.approx(0.8, rel=0.01)
    assert loop.first_peaked
    assert loop.reversal_excess == pytest.approx(0.0, abs=0.01)
    assert loop.speeds == pytest.approx((0.01, 0.01), rel=0.01)


def test_a_run_without_a_whole_loop_is_refused():
    time, *others = synthetic_run(7.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="two strokes"):
        friction.friction_loop(time[:300], *(other[:300] for other in others), bore=0.0257)


def test_a_line_over_pressure_covers_its_truth():
    bars = np.array([1.0, 3.0, 5.0, 7.0])
    found = friction.friction_line(bars, 4 + 0.6 * bars + np.array([0.1, -0.1, -0.1, 0.1]))
    assert found.slope == pytest.approx(0.6, abs=found.slope_half)
    assert found.constant == pytest.approx(4.0, abs=found.constant_half)
    assert 0 < found.slope_half < 0.2


@pytest.mark.parametrize(
    ("law", "sizes"), [("orifice", (2e-4,)), ("laminar", (1e-7,)), ("porous", (7e6, 160.0))]
)
def test_the_laws_of_a_leak_are_told_apart(law, sizes):
    time = np.arange(0, 60, 0.3)
    rate = chambers.LAWS[law][0]
    clean = chambers.pressure_decay(time, 8.5e5, lambda p: rate(p, *sizes))
    noisy = clean + np.random.default_rng(0).normal(0, 300, len(time))
    fits = {name: chambers.fitted_decay(time, noisy, name) for name in chambers.LAWS}
    assert fits[law].sizes == pytest.approx(sizes, rel=0.03)
    assert fits[law].rms < 400
    others = {name for name in ("orifice", "laminar") if name != law}
    assert all(fits[name].rms > 10 * fits[law].rms for name in others)


def test_choked_decay_is_exponential_in_the_absolute_pressure():
    pressure = chambers.pressure_decay(
        np.array([0.0, 1, 2]), 8e5, lambda p: chambers.orifice_rate(p, 2e-4)
    )
    assert pressure[1] / pressure[0] == pytest.approx(pressure[2] / pressure[1], rel=1e-4)


def test_a_settling_is_found_beside_a_leak():
    time = np.arange(0, 140, 0.1)
    size, lag = chambers.settling(time, 8e5 - 30 * time + 2e3 * np.exp(-time / 5))
    assert (size, lag) == pytest.approx((2e3, 5.0), rel=0.05)


def test_a_shorted_turn_is_recovered_and_diffusion_is_not_taken_for_one():
    turn = solenoids.shorted_turn_inductance(solenoids.FREQUENCIES, 0.13, 250.0, 4e-3)
    found = solenoids.fitted_inductor(
        solenoids.FREQUENCIES, turn, solenoids.shorted_turn_inductance, 400.0
    )
    assert (found.inductance, found.eddy, found.leakage) == pytest.approx((0.13, 250.0, 4e-3), rel=1e-3)
    other = solenoids.diffusion_inductance(solenoids.FREQUENCIES, 0.13, 3e-3, 1e-4)
    taken = solenoids.fitted_inductor(
        solenoids.FREQUENCIES, other, solenoids.shorted_turn_inductance, 400.0
    )
    assert taken.worst > 0.3


def test_a_folder_without_data_is_one_sentence(tmp_path):
    pytest.importorskip("matplotlib")
    folders = ("--data", tmp_path / "none", "--out", tmp_path / "out")
    command = (sys.executable, "-m", "docs.scripts.component_data", *folders)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "--data" in done.stderr
    assert not (tmp_path / "out").exists()


FRICTION = ("friction/Circle_1bar.csv", lambda data: friction.read_loop(data, "Circle", 1))
CHAMBER = ("chambers/Prusa.csv", lambda data: chambers.read_chamber(data, "Prusa"))
SOLENOID = (
    "solenoids/SolPosMeas240805_SSBH-0830.csv",
    lambda data: solenoids.temperature_slopes(data, "SSBH-0830"),
)


@pytest.mark.parametrize(
    ("record", "content"),
    [
        (FRICTION, "a\tb\n"),
        (FRICTION, ""),
        (CHAMBER, "hello\n"),
        (CHAMBER, "0.000;3.826;7.652\n"),
        (SOLENOID, "heading\n26,0,x,64.1,206.2\n"),
        (SOLENOID, "heading\n" + 100 * "26,0,9,542.3,600.8\n"),
    ],
)
def test_a_file_that_is_no_record_is_named(tmp_path, record, content):
    name, read = record
    path = tmp_path / name
    path.parent.mkdir()
    path.write_text(content)
    with pytest.raises(ValueError, match="take the file as published") as refused:
        read(tmp_path)
    assert str(path) in str(refused.value)


def test_inductances_follow_one_shorted_turn():
    """These eight figures stand in the script: no folder is needed."""
    for name, measured in solenoids.INDUCTANCES.items():
        turn = solenoids.fitted_inductor(
            solenoids.FREQUENCIES, measured, solenoids.shorted_turn_inductance, 250.0
        )
        assert turn.worst < 0.04, name
        assert 220 < turn.eddy < 280
        assert (
            solenoids.fitted_inductor(
                solenoids.FREQUENCIES, measured, solenoids.diffusion_inductance, 1e-3
            ).worst
            > 0.5
        )


@pytest.fixture(scope="module")
def found():
    if not MEASURED.is_dir():
        pytest.skip("no measured component data beside this repository (../shared/measured)")
    return component_results(MEASURED)


def test_friction_rises_with_pressure(found):
    slopes = {seal: fit.slope for seal, fit in found.lines.items()}
    assert slopes["O-ring257"] == pytest.approx(0.56, abs=0.02)
    assert slopes["X-ring257"] == pytest.approx(1.01, abs=0.03)
    assert slopes["Circle"] == pytest.approx(0.68, abs=0.02)
    assert all(3.3 < fit.constant < 4.5 for fit in found.lines.values())


def test_the_droop_of_the_regulator_would_pass_for_friction(found):
    """A fifth to a third of the force loop is pressure: the correction matters."""
    assert all(1.25 * loop.mean < loop.raw for loop in found.loops.values())


def test_break_away_follows_a_rest_and_no_reversal(found):
    seen = [loop.first_excess for loop in found.loops.values() if loop.first_peaked]
    assert len(seen) == 4
    assert 0.8 < min(seen) < max(seen) < 2.0
    assert all(abs(loop.reversal_excess) < 0.13 for loop in found.loops.values())


def test_leaks_of_prints_lie_between_laminar_and_orifice(found):
    for chamber in chambers.LEAKY_CHAMBERS:
        rms = {law: found.decays[chamber, law].rms for law in chambers.LAWS}
        assert rms["porous"] < 0.02e5
        assert min(rms["orifice"], rms["laminar"]) > 5 * rms["porous"]


def test_currents_fall_faster_than_copper_at_the_case_temperature(found):
    medians = [100 * np.median(slopes) for slopes in found.slopes.values()]
    assert all(-0.65 < median < -0.5 for median in medians)


def test_the_picture_is_drawn(found):
    pytest.importorskip("matplotlib")
    from docs.scripts.component_data.component_figure import component_figure

    assert len(component_figure(found).axes) == 3
    assert (ROOT / "docs/images/component-data.png").exists()
