"""The monitor on white features, where its promises are closed forms; and on openings of the plant."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from epv_env.common.files import JSONFileError
from epv_env.common.units import BAR
from epv_env.plant.plantfile import Plant
from epv_env.plant.supply import Supply
from identification.monitor.features import CONDITIONS, FEATURES, RISE, OpeningReader
from identification.monitor.model import LINEAR, RETURN, SHIPPED, TERMS, MonitorModel
from identification.monitor.monitor import SETTLING, Monitor
from identification.recordings.log_files import read_log
from training.drives import drives, write_log

N = len(FEATURES)
PERIODS = 200
"""Between openings."""


def white_model() -> MonitorModel:
    """Features that are white already; one effect shifts the first, another the second."""
    shifts = np.zeros((2, N, LINEAR))
    shifts[0, 0, 0] = shifts[1, 1, 0] = 2.0
    return MonitorModel(
        centre=np.zeros(len(CONDITIONS)), scale=np.ones(len(CONDITIONS)), whiten=np.eye(N),
        expected=np.zeros((N, TERMS)), effects=("first", "second"),
        components=("solenoid", "flow"), shifts=shifts,
    )  # fmt: skip


def observe(monitor: Monitor, z: np.ndarray) -> None:
    """One opening after PERIODS."""
    for _ in range(PERIODS):
        monitor.update(1.0, 24.0, 11.0, 8.0, 11.0, 0.5)
    monitor.observe(np.zeros(len(CONDITIONS)), z)


def test_false_alarms_are_at_most_as_frequent_as_stated() -> None:
    """On white features a Shiryaev-Roberts statistic with threshold A exceeds A once in A at most."""
    rng, alarms, hours, rate = np.random.default_rng(0), 0, 0.0, 1.0
    for _ in range(20):
        monitor = Monitor(white_model(), false_alarms_per_hour=rate)
        offset = rng.standard_normal(N)
        monitor.period = 1.0
        for _ in range(360):
            monitor._periods += 36
            monitor.observe(np.zeros(len(CONDITIONS)), offset + rng.standard_normal(N))
            if monitor.alarm:
                alarms += 1
                monitor.restart()
                hours += 3.6
    assert alarms <= rate * hours + 3 * np.sqrt(rate * hours)


def test_whatever_the_valve_is_it_is_learnt() -> None:
    """Features a hundred deviations from those of the model's plant make no alarm."""
    rng, monitor = np.random.default_rng(2), Monitor(white_model())
    offset = 100.0 * rng.standard_normal(N)
    for _ in range(100):
        observe(monitor, offset + rng.standard_normal(N))
    assert not monitor.changes


def test_changes_and_a_return_are_found_dated_and_named() -> None:
    """Nothing, the second effect, the first one beside it, and that one gone again."""
    rng, monitor, size = np.random.default_rng(1), Monitor(white_model()), 2.0 * np.eye(N)
    states = [0.0 * size[0], size[1], size[0] + size[1], size[1]]
    for part, state in enumerate(states):
        for _ in range(50):
            observe(monitor, rng.standard_normal(N) + state)
        assert len(monitor.changes) == part
    assert not monitor.alarm
    named = [next(iter(change.causes)) for change in monitor.changes[:3]]
    assert named == ["second", "first", RETURN]
    assert next(iter(monitor.changes[0].components)) == "flow"
    seconds = PERIODS * monitor.period
    for part, change in enumerate(monitor.changes, start=1):
        assert change.onset == pytest.approx(50 * part * seconds, abs=3 * seconds)


def test_one_opening_alone_makes_no_alarm() -> None:
    """As when a row is lost in it: all features look like an effect. The second one does."""
    model, far = white_model(), np.full(N, 3.5)
    model.shifts[0, :, 0] = far
    monitor = Monitor(model)
    for _ in range(20):
        observe(monitor, 0.0 * far)
    for alarm in (False, True):
        observe(monitor, far)
        assert monitor.log_odds > 0.0
        assert monitor.alarm == alarm


def test_saved_and_loaded_is_the_same(tmp_path: Path) -> None:
    model = white_model()
    model.save(tmp_path / "monitor.json")
    loaded = MonitorModel.load(tmp_path / "monitor.json")
    for name, value in vars(model).items():
        np.testing.assert_array_equal(getattr(loaded, name), value)


ON, OFF, LAST = 20, 20, 10
"""Periods of an opening made by hand."""


def opening() -> np.ndarray:
    """Readings (periods, 6): while the coil is off p3 falls by a factor a period; p2 rises late."""
    coil = np.repeat([1.0, 0.0, 1.0], [ON, OFF, LAST])
    p3 = np.repeat(11.0, len(coil))
    p3[ON + 1 : ON + OFF + 1] = 11.0 * 0.9 ** np.arange(1, OFF + 1)
    p2 = 8.0 + 0.1 * np.maximum(np.arange(len(coil)) - ON - 10.0, 0.0)
    return np.column_stack(np.broadcast_arrays(coil, 24.0, 11.0, p2, p3, 0.48))


def test_an_opening_is_read_as_it_was() -> None:
    reader = OpeningReader()
    ((conditions, z),) = [found for row in opening() if (found := reader.update(row)) is not None]
    values: dict[str, float] = dict(zip((*FEATURES, *CONDITIONS), [*z, *conditions], strict=True))
    opens = 10.0 + RISE / 0.1  # periods after the command
    expected = {
        "I_on": 0.02, "p3_rest": 0.0, "p3_off_1": np.log(0.9), "p3_vents_late": 4 * np.log(0.9),
        "time_opens": opens, "open": OFF - opens, "p1": 11.0, "p2": 8.0, "U": 24.0, "slope": 0.0,
        "p2_rise": 0.1 * (OFF - 10),
    }  # fmt: skip
    assert {name: values[name] for name in expected} == pytest.approx(expected)


@pytest.mark.parametrize(("lengths", "pause"), [((20, 20, 10), 30), ((20, 5, 3, 60, 10), None)])
def test_an_opening_without_a_known_beginning_does_not_count(lengths, pause) -> None:
    """Readings are missing, or the coil was on for too short a time before."""
    reader = OpeningReader()
    for number, coil in enumerate(np.repeat([1.0, 0.0, 1.0, 0.0, 1.0][: len(lengths)], lengths)):
        if number == pause:
            reader.pause()
        assert reader.update((coil, 24.0, 11.0, 8.0 + 0.1 * number, 11.0, 0.5)) is None


def test_the_log_of_a_drive_has_openings(tmp_path) -> None:
    """A log gives the coil's voltage, which is 0 while the coil is off."""
    controller = Hysteresis(open_below=-0.3, shut_above=0.0)
    write_log(tmp_path / "log", controller, Plant.calibrated(), [3], duration=30.0)
    monitor = Monitor(white_model())
    for d in read_log(tmp_path / "log").drives:
        monitor.follow(np.column_stack([d.coil, d.U, d.p1 / BAR, d.p2 / BAR, d.p3 / BAR, d.I]))
    assert len(monitor.history) >= 3


@pytest.mark.parametrize("column", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("value", [1.7e308, -1e300, 1e154, 5e-324, 0.0, np.inf, np.nan])
def test_a_reading_of_any_size_leaves_the_monitor_able_to_find_a_change(column, value) -> None:
    """After openings with the reading in each place, a shift of every feature is found."""
    monitor = Monitor(white_model())
    for place in range(ON + OFF + LAST):
        rows = opening()
        rows[place, column] = value
        monitor.follow(rows)
    assert len(monitor.history) > 0
    assert np.isfinite(monitor.log_odds)
    assert monitor.restarts == 0
    present = monitor._mean + monitor._reference[:, 0]
    for shift in (0.0, 2.0 * np.eye(N)[1]):
        for _ in range(40):
            observe(monitor, present + shift)
    assert next(iter(monitor.changes[-1].causes)) == "second"


def test_a_state_that_is_not_finite_restarts() -> None:
    monitor = Monitor(white_model())
    for _ in range(SETTLING):
        observe(monitor, np.zeros(N))
    monitor._mean[3] = np.nan
    observe(monitor, np.zeros(N))
    assert monitor.restarts == 1
    assert np.isfinite(monitor.log_odds)


def test_what_is_shipped_finds_a_change_and_its_return() -> None:
    plant, model = Plant.calibrated(), MonitorModel.load(SHIPPED)
    eddy = plant.parameters.replace(G_eddy=0.004)
    monitor = Monitor(model)
    for part, p in enumerate([plant.parameters, eddy, plant.parameters]):
        chosen = {"parameters": [p] * 2}
        for drive in drives(plant, Hysteresis(open_below=-0.3, shut_above=0.0), [part, 9], chosen):
            monitor.follow(drive)
        assert len(monitor.changes) == part
    assert [next(iter(c.causes)) for c in monitor.changes] == ["eddy_current", RETURN]
    assert [c.onset for c in monitor.changes] == pytest.approx([60.0, 120.0], abs=6.0)


def test_a_warm_winding_and_another_supply_are_no_change() -> None:
    plant, controller = Plant.calibrated(), Hysteresis(open_below=-0.3, shut_above=0.0)
    monitor, R = Monitor(MonitorModel.load(SHIPPED)), plant.parameters["R"]
    for warm, bar in [(1.0, 12.0), (1.08, 10.0), (1.15, 13.0)]:
        chosen = {"parameters": [plant.parameters.replace(R=warm * R)], "supply": Supply.constant(bar)}
        (drive,) = drives(plant, controller, [7], chosen)
        monitor.follow(drive)
    assert len(monitor.history) > 30
    assert monitor.probability < 0.5
    assert not monitor.changes


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("scale", 0.0, "scale holds 0, not a number from 1e-09 to 1e+09"),
        ("scale", -1.0, "scale holds -1, not"),
        ("scale", 1e300, "scale holds 1e"),
        ("whiten", 1e12, "whiten holds 1e"),
        ("centre", -1e30, "centre holds -1e"),
    ],
)
def test_numbers_out_of_range_get_one_sentence(name, value, said, tmp_path: Path) -> None:
    model = white_model()
    getattr(model, name).flat[-1] = value
    model.save(tmp_path / "monitor.json")
    with pytest.raises(JSONFileError, match=re.escape(said)) as caught:
        MonitorModel.load(tmp_path / "monitor.json")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["", "a b", "a\nb", "é", "2nd", "return", "unknown"])
@pytest.mark.parametrize("which", ["effects", "components"])
def test_a_name_that_is_none_is_refused(which, name, tmp_path: Path) -> None:
    path = tmp_path / "monitor.json"
    white_model().save(path)
    content = json.loads(path.read_text())
    content[which][0] = name
    path.write_text(json.dumps(content))
    with pytest.raises(JSONFileError, match="is no name"):
        MonitorModel.load(path)
