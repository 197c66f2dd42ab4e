"""Operation logs: written by the environment, cut into openings, diagnosed with their onset."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
import pytest

import epv_env  # noqa: F401 - registers the environments
from controllers.tuned import tuned
from epv_env.common.units import GRAM
from epv_env.operation_log import OperationLog
from epv_env.plant.plantfile import Plant
from epv_env.signals import OptionError
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.search.onset import (
    LinearisedLog,
    Onset,
    Span,
    gain_by_change,
    in_span,
    likeliest_span,
    spans_of_causes,
)
from identification.recordings.log_files import Drive, Log, read_log
from identification.recordings.openings import drive_of, openings, pauses, start_of
from identification.recordings.recording import CampaignError, Recording
from identification.replay.model_inputs import model_inputs
from identification.valve_gap.logged_valve import LoggedValve, steady_openings
from training.drives import write_log

PLANT = Plant.calibrated()


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs") / "valve"
    write_log(
        folder, tuned("extrapolating hysteresis"), PLANT, range(2), duration=10.0, scenario="service"
    )
    return folder


def test_a_log_holds_what_the_controller_read(healthy):
    log = read_log(healthy)
    assert [d.file for d in log.drives] == ["drive-1.csv", "drive-2.csv"]
    first = log.drives[0]
    assert len(first.coil) == 2000
    assert set(np.unique(first.U)) == {0.0, 24.0}
    # The readings at a switching are still those of the coil before it.
    off = np.flatnonzero(np.diff(first.coil) < 0) + 1
    assert np.all(first.I[off] > 0.3)
    later = off[off + 2 < len(first.I)] + 2
    assert np.all(first.I[later[first.coil[later - 1] == 0]] < 0.1)


def test_openings_begin_steady_and_know_the_leak(tmp_path):
    env = OperationLog(gymnasium.make("EPValve-v0", scenario="none", p2_bar=8.0), tmp_path / "log")
    env.reset(seed=1)
    for k in range(1000):  # the piston hardly opens in 40 ms, and the circuit leaks nothing
        env.step(int(k % 100 >= 8))
    env.close()
    campaign, steady = openings(read_log(tmp_path / "log"), PLANT.parameters)
    assert steady == {recording.name for recording in campaign.recordings}
    for recording in campaign.recordings:
        assert np.ptp(recording.p3[:8]) < 1e4
        assert recording.energised[0]
        assert abs(recording.sigma_S[0]) < 0.2 * GRAM  # p2's noise over 0.1 s allows 0.05
        assert drive_of(recording.name) == "drive-1.csv"
        assert start_of(recording.name) > 0.0


def test_openings_begin_with_the_control_chamber_settled(tmp_path):
    env = OperationLog(gymnasium.make("EPValve-v0", scenario="none", p2_bar=8.0), tmp_path / "log")
    env.reset(seed=1)
    for coil in np.concatenate([np.repeat([0, 1], [10, rest]) for rest in range(20, 50)]):
        env.step(int(coil))
    env.close()
    campaign, _ = openings(read_log(tmp_path / "log"), PLANT.parameters)
    assert len(campaign.recordings) > 10
    for recording in campaign.recordings:
        assert abs(recording.p3[0] - np.mean(recording.p1[:8])) < 4e3  # four standard deviations


@pytest.mark.parametrize(("symbol", "size"), [("G_eddy", 0.004), ("theta_coil", 20.0)])
def test_a_cause_acts_from_its_drive_on(symbol, size, healthy):
    log = read_log(healthy)
    campaign, steady = steady_openings(log, PLANT)
    whole = LoggedValve(campaign, PLANT, steady)
    late = whole.acting_in({c.label: Span(1, 2, 1.0, False, (1, 1)) for c in whole.causes})
    runs = range(len(whole.runs))
    acting = {symbol: np.array([size])}
    none, every, second = (
        plant.outputs(values, runs)
        for plant, values in ((whole, {symbol: np.zeros(1)}), (whole, acting), (late, acting))
    )
    for run, without, both, one in zip(whole.runs, none, every, second, strict=True):
        np.testing.assert_array_equal(one, both if run.name.startswith("drive-2") else without)
        assert np.any(both != without)


TRUE = {"first": (1, 3), "second": (2, 4), "third": (0, 4)}
"""Drives in which causes act, of four."""


def linearised(sizes: dict[str, float]) -> tuple[Any, Any, Any]:
    """Runs in which causes of these sizes act, signatures of all causes, and each run's drive."""
    rng, drives = np.random.default_rng(0), np.repeat(np.arange(4), 3)
    signatures = [
        SimpleNamespace(
            cause=SimpleNamespace(label=label), changes=list(rng.normal(size=(12, 40))), shares=(-9, 9)
        )
        for label in TRUE
    ]
    runs = []
    for r, drive_number in enumerate(drives):
        residual = rng.normal(size=40)
        for signature in signatures:
            label = signature.cause.label
            size = sizes.get(label, 0.0) * in_span(np.array(drive_number), *TRUE[label])
            residual += size * signature.changes[r]
        none = np.zeros((40, 0))
        runs.append(
            LinearisedRun(
                residual=residual, slopes=np.ones((40, 1)), slope_precision=np.zeros(1),
                slope_values=np.zeros(1), run_slopes=none, run_values=np.zeros(0), run_sd=np.zeros(0),
                shared_slopes=none,
            )
        )  # fmt: skip
    return runs, signatures, drives


def test_each_cause_has_its_drives_also_beside_another_one():
    """The first acts in drives 1 and 2 and is mended; the second, smaller one begins in drive 2."""
    sizes = {"first": 3.0, "second": 1.0}
    spans = spans_of_causes(LinearisedLog(*linearised(sizes), 4, 480))
    for label in sizes:
        assert (spans[label].first, spans[label].end) == TRUE[label]
        assert spans[label].probability > 0.9
    assert spans["first"].onset(["a", "b", "c", "d"]) == Onset(
        "b", spans["first"].probability, "d", "b", "b"
    )


@pytest.mark.parametrize(
    ("sizes", "changes", "differs"),
    [({}, False, False), ({"third": 1.0}, False, True), ({"third": 1.0, "second": 1.0}, True, True)],
)
def test_what_acts_in_all_drives_is_a_change_of_a_known_valve_alone(sizes, changes, differs):
    log = LinearisedLog(*linearised(sizes), 4, 480)
    assert (gain_by_change(log) > 1.0) == changes
    assert (gain_by_change(log, known=True) > 1.0) == differs


def test_of_spans_that_no_opening_tells_apart_the_shortest_is_taken():
    spans = [(0, 3), (1, 3), (2, 3)]  # nothing was compared in the second drive
    span = likeliest_span(np.array([900.0, 500.0, 500.0]), spans, 3, 500)
    assert (span.first, span.first_between) == (2, (1, 2))


@pytest.mark.parametrize(("grams", "count"), [(0.0, 4), (-0.3, 4), (0.3, 0)])
def test_nothing_is_consumed_where_consumption_is_lowest_and_not_above_zero(grams, count):
    rng, time = np.random.default_rng(0), 0.005 * np.arange(2000)
    p = PLANT.parameters
    slope = -grams * GRAM * p["R_gas"] * 293.0 / p["V2"]
    steady = {name: 11e5 + 1e3 * rng.normal(size=2000) for name in ("p1", "p3")}
    drive = Drive(
        file="drive-1.csv", coil=np.ones(2000), U=np.full(2000, 24.0), I=np.full(2000, 0.5),
        p2=7e5 + slope * time + 1e3 * rng.normal(size=2000), target=np.full(2000, 7e5), **steady,
    )  # fmt: skip
    log = Log(name="", temperature=293.0, pressure=1e5, period=0.005, drives=(drive,))
    resting = pauses(log, p)
    assert len(resting) == count
    assert all(np.all(recording.sigma_S == 0.0) for recording in resting)


def test_an_opening_begins_at_the_pressure_of_its_first_sample():
    """Consumption of 5 g/s lowers p2 while it is averaged over the hold."""
    time, p = 0.005 * np.arange(40), PLANT.parameters
    slope = -5.0 * GRAM * p["R_gas"] * p["T_env"] / p["V2"]
    same: Any = {name: np.full(40, value) for name, value in {"U": 24.0, "I": 0.5, "p1": 11e5}.items()}
    recording = Recording(
        name="opening", role="calibration", period=0.005, p2=8e5 + slope * time,
        p3=same["p1"], sigma_S=np.full(40, 5.0 * GRAM), **same,
    )  # fmt: skip
    assert model_inputs(recording, p).p2_start == pytest.approx(8e5, abs=1.0)


def test_the_reading_on_which_the_controller_opens_does_not_count(healthy):
    campaign, steady = steady_openings(read_log(healthy), PLANT)
    for run in LoggedValve(campaign, PLANT, steady).runs:
        opens = np.flatnonzero(np.diff(run.inputs["U"]) < 0.0) + 1
        doubted = np.zeros(len(run.time), dtype=bool)
        doubted[opens] = True
        assert np.all(run.trusted[0] == (~doubted if run.name in steady else False))


def test_a_log_is_refused_in_a_sentence(healthy, tmp_path):
    log = read_log(healthy)
    few = replace(log, drives=(replace(log.drives[0], coil=np.ones(2000)),))
    with pytest.raises(CampaignError, match="openings can be compared, too few"):
        openings(few, PLANT.parameters)
    with pytest.raises(OptionError, match="needs EPValve-v0"):
        OperationLog(gymnasium.make("EPValvePWM-v0"), tmp_path / "pwm")
    with pytest.raises(OptionError, match="holds files already"):
        OperationLog(gymnasium.make("EPValve-v0"), healthy)
    for change, told in [
        (lambda text: text.replace(",target_bar", ",goal"), "missing target_bar"),
        (lambda text: text.replace("0.005000,", "0.004000,", 1), "time"),
        (lambda text: re.sub(r"\n0.000000,\d,", "\n0.000000,2,", text), "coil is 2"),
    ]:
        copy = tmp_path / "copy"
        copy.mkdir(exist_ok=True)
        for file in healthy.iterdir():
            (copy / file.name).write_text(file.read_text())
        (copy / "drive-1.csv").write_text(change((healthy / "drive-1.csv").read_text()))
        with pytest.raises(CampaignError, match=told):
            read_log(copy)


def scaled(column, factor, offset=0.0):
    """The text of a drive with factor × reading + offset in a column."""

    def change(text):
        head, *lines = text.splitlines()
        at = head.split(",").index(column)
        cells = [line.split(",") for line in lines]
        rows = [[*c[:at], repr(factor * float(c[at]) + offset), *c[at + 1 :]] for c in cells]
        return "\n".join([head, *(",".join(row) for row in rows)]) + "\n"

    return change


def one_wild(text):
    return text.replace(",24.00,", ",1e300,", 1)


@pytest.fixture(scope="module")
def often_opened(tmp_path_factory):
    """The log of a drive with an opening of 100 ms each 300 ms."""
    folder = tmp_path_factory.mktemp("opened") / "log"
    env = OperationLog(gymnasium.make("EPValve-v0", scenario="none", p2_bar=8.0), folder)
    env.reset(seed=1)
    for k in range(1000):
        env.step(int(k % 60 >= 20))
    env.close()
    return folder


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (scaled("p2_bar", 100.0), "beyond the sensor's 16 bar: check unit, .* of p2_bar"),
        (scaled("p3_bar", 1.0, -1.0), "joins them: check unit, reference, .* of p1_bar, p3_bar"),
        (scaled("I_A", -1.0), "A make -[0-9.]+ ohm, and coils have 8 to 220 ohm"),
        (scaled("I_A", 0.0, -1.0), "line 2?[0-9]+: .*and coils have 8 to 220 ohm"),
        (one_wild, r"drive-1.csv, line 2: U_supply_V is 1e\+300, outside the sensor's range"),
    ],
)  # fmt: skip
def test_readings_that_no_valve_shows_are_refused(change, told, often_opened, tmp_path):
    (tmp_path / "log.json").write_text((often_opened / "log.json").read_text())
    (tmp_path / "drive-1.csv").write_text(change((often_opened / "drive-1.csv").read_text()))
    with pytest.raises(CampaignError, match=told):
        read_log(tmp_path)


@pytest.mark.parametrize(
    ("failed", "told"),
    [
        (scaled("I_A", 0.0, 0.5), "A flows while the coil is off"),
        (scaled("I_A", 0.0), "make inf ohm, .*: check unit, reference, sign and"),
    ],
)
def test_a_sensor_that_fails_on_the_way_is_left_to_the_diagnosis(failed, told, often_opened, tmp_path):
    """A current that stays, or none: from the second drive on a fault, in all drives refused."""
    text = (often_opened / "drive-1.csv").read_text()
    content = json.loads((often_opened / "log.json").read_text())
    content["drives"] = [{"file": name} for name in ("drive-1.csv", "drive-2.csv")]
    (tmp_path / "log.json").write_text(json.dumps(content))
    (tmp_path / "drive-1.csv").write_text(text)
    (tmp_path / "drive-2.csv").write_text(failed(text))
    assert len(read_log(tmp_path).drives) == 2
    (tmp_path / "drive-1.csv").write_text(failed(text))
    with pytest.raises(CampaignError, match=rf"drive-1.csv, line .*{told}"):
        read_log(tmp_path)


@pytest.mark.parametrize("rest", [0.03, 0.12, 0.25])
def test_a_current_that_never_ends_is_left_to_the_diagnosis(rest, often_opened, tmp_path):
    """In all drives, from the first one on: an eddy current, a driver or a sensor."""
    for file in often_opened.iterdir():
        (tmp_path / file.name).write_text(file.read_text())
    frame = pd.read_csv(tmp_path / "drive-1.csv")
    frame["I_A"] = np.maximum(frame["I_A"], rest)
    frame.to_csv(tmp_path / "drive-1.csv", index=False)
    log = read_log(tmp_path)
    assert openings(log, PLANT.parameters)[0].recordings


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"drives": [{"file": "drive-1.csv"}] * 2}, "drive 2: drive-1.csv is named twice"),
        ({"control_period_s": 0.0}, "states a control period of 0 s"),
        ({"environment": {"temperature_K": 0.0, "pressure_bar": 1.0}}, "temperature_K is 0.0"),
    ],
)
def test_a_manifest_that_cannot_be_is_refused(change, told, often_opened, tmp_path):
    assert len(read_log(often_opened).drives) == 1
    content = json.loads((often_opened / "log.json").read_text()) | change
    (tmp_path / "log.json").write_text(json.dumps(content))
    (tmp_path / "drive-1.csv").write_text((often_opened / "drive-1.csv").read_text())
    with pytest.raises(CampaignError, match=told):
        read_log(tmp_path)


def test_a_log_of_another_control_period_is_read(often_opened, tmp_path):
    content = json.loads((often_opened / "log.json").read_text()) | {"control_period_s": 0.1}
    (tmp_path / "log.json").write_text(json.dumps(content))
    slower = scaled("time_s", 20.0)((often_opened / "drive-1.csv").read_text())
    (tmp_path / "drive-1.csv").write_text(slower)
    assert read_log(tmp_path).period == 0.1
