"""A controller's own figures: as logged, as simulated, and what a cause explains of the difference."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from controllers.policy import load_policy
from controllers.tuned import tuned
from epv_env.common.units import BAR, GRAM
from epv_env.plant.plantfile import Plant
from epv_env.signals import RecordedConsumption
from identification.commands import gap
from identification.gap.search.onset import Onset
from identification.recordings.log_files import Drive, Log
from identification.valve_gap import operation
from training import closed_loop, epv
from training.closed_loop import KINDS, ClosedLoop, consumption, sentence
from training.drives import drives, write_log

PLANT, TARGET = Plant.calibrated(), 8.0
policy = cache(load_policy)
TIME = np.arange(2400) * 0.005
FLOW = np.interp(TIME % 4.0, [1.0, 1.2, 2.0, 2.3], [0.1, 3.0, 3.0, 0.1])
"""Consumption of brake applications [g/s]."""


def with_effect(**sizes: float) -> Plant:
    return replace(PLANT, parameters=PLANT.parameters.replace(**sizes))


@pytest.fixture(autouse=True)
def few_repeats(monkeypatch):
    monkeypatch.setattr(closed_loop, "REPEATS", 2)


@cache
def logged(**sizes: float) -> Log:
    """What the shipped policy logs on a plant with an effect."""
    scenario = RecordedConsumption.from_samples(TIME, FLOW)
    options = {"scenario": scenario, "target_bar": TARGET}
    rows = drives(with_effect(**sizes), policy(), [1, 2], options, duration=12.0)
    target = np.full(len(TIME), TARGET * BAR)
    found = [
        Drive(
            file=f"drive-{k}.csv", coil=coil, U=coil * u, p1=p1 * BAR, p2=p2 * BAR, p3=p3 * BAR,
            I=current, target=target,
        )
        for k, (coil, u, p1, p2, p3, current) in enumerate(np.moveaxis(rows, 2, 1))
    ]  # fmt: skip
    p = PLANT.parameters
    return Log(
        name="log", temperature=p["T_env"], pressure=p["p_env"], period=0.005, drives=tuple(found)
    )


@pytest.mark.parametrize("sizes", [{}, {"tau_p2": 0.02}, {"A_PV": 5e-8}, {"F_PV": 8.0}])
def test_consumption_is_read_off_p2(sizes):
    found = consumption(logged(**sizes).drives[0], 0.005, with_effect(**sizes).parameters) / GRAM
    assert np.sqrt(np.mean((found - FLOW)[100:] ** 2)) < 0.3
    assert abs(np.mean((found - FLOW)[100:])) < 0.06


def test_a_cause_explains_what_it_did_to_the_controller():
    lag = {"tau_p2": 0.03}
    result = ClosedLoop(logged(**lag), PLANT, policy()).compared(with_effect(**lag))
    explained = dict(zip([kind.title for kind in KINDS], result.explained, strict=True))
    for title in ("rms of p2 - target", "highest overshoot", "switchings"):
        assert explained[title] > 0.7
    assert sentence(result, "with lag")[0] == "good"
    nothing = result._replace(corrected=result.given)
    assert sentence(nothing, "recalibrated")[0] == "doubt"


def test_nothing_is_claimed_without_an_effect():
    result = ClosedLoop(logged(), PLANT, policy()).compared(with_effect(tau_p2=0.001))
    assert np.all(np.isnan(result.explained))
    assert "as far as this method can tell" in sentence(result, "recalibrated")[1]


def test_only_drives_in_which_the_cause_acts_count():
    loop = ClosedLoop(logged(), PLANT, policy())
    model = SimpleNamespace(labels=("lag",), title="lag of p2")
    found: Any = SimpleNamespace(
        onset=Onset("drive-1.csv", 0.99, None, "drive-1.csv", "drive-1.csv"), model=model
    )
    (section,) = loop.sections(found, with_effect(tau_p2=0.02))
    table: Any = section.blocks[0]
    assert table.columns[3] == "with lag of p2"
    assert "drive-1.csv" in table.caption
    assert "drive-0.csv" not in table.caption


def test_a_controller_that_wrote_no_log_is_refused_before_the_diagnosis():
    log = logged()
    with pytest.raises(ValueError, match="cannot have written a log"):
        ClosedLoop(log, PLANT, tuned("PWM"))
    with pytest.raises(ValueError, match="decides each 5 ms"):
        ClosedLoop(replace(log, period=0.01), PLANT, policy())


def test_the_command_adds_the_section_to_the_report_of_a_log(tmp_path, monkeypatch):
    controller = Hysteresis(open_below=-0.3, shut_above=0.0)
    write_log(tmp_path / "log", controller, PLANT, [1], duration=2.0)
    asked: dict[str, Any] = {}
    monkeypatch.setattr(operation, "diagnose_log", lambda *folders, **options: asked.update(options))
    monkeypatch.setattr(gap, "say", lambda *_: None)
    monkeypatch.setattr(gap, "next_step", lambda _: None)
    words = ["gap", str(tmp_path / "log"), "--logs", "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", ["epv", *words, "--controller", "hysteresis"])
    assert epv.main() == 0
    assert asked["more"].__self__.controller.name == "hysteresis"
    monkeypatch.setattr("sys.argv", ["epv", *words, "--controller", "PWM"])
    assert epv.main() == 2  # it cannot have written a log
