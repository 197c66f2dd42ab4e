"""Faulty readings are found where they are, before anything is fitted; a plant's own motion is none."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.plant import Channel, PlantError, Run
from identification.gap.prepare.screened import Finding, screen
from identification.gap.report.gap_json import as_json
from identification.gap.report.sentences import verdict_sentence
from tests.identification.gap.drives import Drive
from tests.identification.gap.ode_plants import swung
from tests.identification.gap.tanks import diagnosed

LEAKING = {"c": 0.021, "leak": 4e-3}

SPIKES = {5: 0.08, 60: -0.09, 61: 9.9, 90: 0.08, 130: -0.3, 170: 1e9, 172: 0.1, 200: -1e3, 234: 0.08}
"""Errors of readings by sample; the least is 20 noise deviations or more."""


def tank() -> list[NDArray]:
    """Levels of three runs [m], (240,) each."""
    return [run.measured[0] for run in virtual_recordings(LEAKING)]


def valve() -> list[NDArray]:
    """Pressures that vent through an orifice and fill fast, rounded [mbar], (600,) each."""
    runs = []
    for seed in range(3):
        target = np.repeat([12e3, 1e3, 12e3, 1e3, 12e3], 120)
        pressure = [12e3]
        for aim in target[1:]:
            pressure.append(pressure[-1] + (aim - pressure[-1]) * (0.1 if aim > pressure[-1] else 0.01))
        noise = 7.0 * np.random.default_rng(seed).standard_normal(len(target))
        runs.append(3.66 * np.round((pressure + noise) / 3.66))
    return runs


DATA = {"tank": tank, "valve": valve}


def found(series: Sequence[NDArray], **known: float) -> tuple[Finding, ...]:
    """Faulty readings of a channel y; series: of each run, (samples,)."""
    runs = [as_run(str(r), own) for r, own in enumerate(series)]
    return screen(runs, [Channel(name="y", unit="", scale=1.0, **known)])[1]


def as_run(name: str, readings: NDArray, **inputs: NDArray) -> Run:
    """A run of one channel, all of whose readings (samples,) are trusted."""
    return Run(
        name=name,
        held_out=False,
        time=np.arange(len(readings), dtype=float),
        measured=readings[None],
        trusted=np.ones((1, len(readings)), dtype=bool),
        inputs=inputs,
    )


@pytest.mark.parametrize("data", DATA)
@pytest.mark.parametrize("runs", [(1,), (0, 1, 2)], ids=["one run", "every run"])
def test_wild_readings_of_any_size_are_found(data, runs):
    series = DATA[data]()
    for r in runs:
        unit = np.ptp(series[r]) / 0.5
        series[r][list(SPIKES)] += unit * np.array(list(SPIKES.values()))
    expected = [Finding(file=str(r), channel="y", samples=tuple(SPIKES), kind="wild") for r in runs]
    assert list(found(series)) == expected


@pytest.mark.parametrize("data", DATA)
@pytest.mark.parametrize(
    ("kind", "value"), [("stuck", None), ("dropout", np.nan), ("dropout", 0.0), ("clipped", None)]
)
def test_a_stretch_that_reads_nothing_is_found(data, kind, value):
    series = DATA[data]()
    own = series[1]
    samples = np.arange(130, 165)
    if kind == "clipped":
        limit = 3.66 * 3265 if data == "valve" else np.quantile(own, 0.9)
        samples = np.flatnonzero(own >= limit)
        own[samples] = limit
    else:
        own[samples] = own[130] if value is None else value
    (finding,) = found(series)
    assert (finding.file, finding.kind) == ("1", kind)
    assert set(finding.samples) >= set(samples)
    assert len(finding.samples) <= len(samples) + 2  # a rounded neighbour may be equal by chance


def impacts() -> list[NDArray]:
    """A ball that bounces: speed [m/s], (800,) each."""
    speed = [0.0]
    for i in range(799):
        speed.append(-0.8 * speed[-1] if i % 97 == 96 else speed[-1] - 0.0981)
    return [speed + 0.01 * np.random.default_rng(seed).standard_normal(800) for seed in range(3)]


def steps() -> list[NDArray]:
    """Steps and short pulses with noise, (600,) each."""
    clean = np.repeat([0.0, 1.0, 0.2, 3.0, 0.0, 5.0, 5.0, 2.0], 75)
    clean[100:104] += 2.0
    return [clean + 0.01 * np.random.default_rng(seed).standard_normal(600) for seed in range(3)]


def landing() -> list[NDArray]:
    """The current of a solenoid [mA], with the cusp where its armature lands, (400,) each."""
    rise = 500.0 * (1.0 - np.exp(-np.arange(400) / 6.0))
    cusp = np.concatenate([np.zeros(12), [8.0, 25.0, 60.0, 45.0, 34.0, 26.0, 20.0, 15.0, 11.0, 8.0]])
    rise[: len(cusp)] -= cusp
    return [rise + 0.9 * np.random.default_rng(seed).standard_normal(400) for seed in range(3)]


CLEAN = {
    **DATA,
    "steps": steps,
    "impacts": impacts,
    "landing": landing,
    "exact": lambda: [np.minimum(np.arange(300) / 100.0, 1.5), np.sin(np.arange(300) / 20.0)],
    "rounded": lambda: [np.round(own / 0.02) * 0.02 for own in tank()],
    "encoder": lambda: [np.round(np.sin(np.arange(900) / 200.0) / 0.05) * 0.05] * 2,
    "held": lambda: [np.repeat(own, 10) for own in tank()],
    "drive": lambda: [run.measured[0] for run in Drive({"dead_zone": 0.3, "limit": 0.7}).runs],
    "oscillator": lambda: [run.measured[0] for run in swung(120, 6, coulomb=0.2).runs],
}


@pytest.mark.parametrize("data", CLEAN)
def test_motion_and_rounding_are_no_faults(data):
    assert found(CLEAN[data]()) == ()


def test_a_command_is_no_fault_and_a_wild_input_is_bridged():
    held = np.repeat([0.0, 1.0, 0.0, 2.0], 60)
    held[100] = 1.0  # a pulse
    measured = held + 0.01 * np.random.default_rng(0).standard_normal(240)
    wild = held.copy()
    wild[40] = 50.0
    run = as_run("first", tank()[0], held=held, measured=measured, wild=wild)
    (kept,), findings = screen([run], [Channel(name="y", unit="", scale=1.0)])
    by_input = {own.channel: own.samples for own in findings}
    assert by_input.pop("wild") == (40,)
    assert set(by_input) <= {"measured"}
    np.testing.assert_array_equal(kept.inputs["wild"], held)
    np.testing.assert_array_equal(kept.inputs["held"], held)


def test_a_channel_that_is_mostly_lost_is_refused():
    series = tank()
    series[2][100:] = np.nan
    with pytest.raises(
        PlantError, match=r"run 2: 140 of 240 readings of channel y are .* leave the run"
    ):
        found(series)


def spoilt() -> Tank:
    """A leaking tank with wild readings in every run, one of them in the inflow."""
    rng, runs = np.random.default_rng(1), []
    for run in virtual_recordings(LEAKING):
        samples = rng.choice(240, 10, replace=False)
        measured, inflow = run.measured.copy(), run.inputs["q"].copy()
        measured[0, samples] += rng.choice([-1.0, 1.0], 10) * rng.uniform(0.05, 1.0, 10)
        measured[0, 100], inflow[77] = 9.9, 1.0
        runs.append(replace(run, measured=measured, inputs={"q": inflow}))
    return Tank(runs)


@cache
def of_spoilt() -> Diagnosis:
    return diagnose(spoilt())


def test_a_diagnosis_is_the_same_with_wild_readings():
    content, clean = as_json(of_spoilt()), as_json(diagnosed("known"))
    assert content["verdict"] == clean["verdict"] == "known"
    assert content["ambiguity_set"] == [["leak"]]
    _, low, high = clean["causes"][0]["magnitude"]["leak_1_per_s"]
    assert low < content["causes"][0]["magnitude"]["leak_1_per_s"][0] < high
    assert content["gap"]["with_cause"] < 1.1


def test_what_was_screened_is_said():
    screened = as_json(of_spoilt())["screened"]
    assert {(own["file"], own["channel"]) for own in screened} == {
        (run, signal) for run in ("test_1", "test_2", "validation") for signal in ("h", "q")
    }
    assert all(
        own["kind"] == "wild" and 100 in own["samples"] for own in screened if own["channel"] == "h"
    )
    assert any("h of test_1 at sample" in warning for warning in of_spoilt().warnings)
    assert verdict_sentence(of_spoilt())[0] == "doubt"
