"""The blind check's recordings, and the gaps of models against the noise-free truth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.studies.blind.bench import run_programme, true_recordings
from docs.studies.blind.explainable import explainable_gap, held_out_gap
from docs.studies.blind.study import QUICK_SUITE
from docs.studies.blind.truth import NOMINAL, ONE_CAUSE, Trial, draw_trial
from identification.bench import session as bench

pytestmark = pytest.mark.slow

SHORT = QUICK_SUITE[0]


@cache
def recordings(effect=""):
    return true_recordings(trial(effect), 0, QUICK_SUITE)


def trial(effect="") -> Trial:
    return draw_trial(7, 0, ONE_CAUSE if effect else NOMINAL, [effect] if effect else [])


def run(effect, deviation):
    rng = np.random.default_rng(0)
    return run_programme(trial(effect).parameters, SHORT, form_deviation=deviation, rng=rng).channels


def test_without_an_effect_the_bench_is_the_nominal_plant():
    unit = trial().unit
    nominal = bench.run_programme(unit, SHORT).channels
    found = run_programme(unit, SHORT, form_deviation=0.0, rng=np.random.default_rng(0)).channels
    for name, least in (("p1", 50.0), ("p2", 50.0), ("p3", 50.0), ("I", 5e-5)):
        np.testing.assert_allclose(found[name], nominal[name], atol=least)


@pytest.mark.parametrize(
    ("effect", "channel", "least"),
    [
        ("pressure_sensor_bias", "p2", 20.0),
        ("pressure_sensor_gain", "p2", 20.0),
        ("current_sensor_gain", "I", 1e-5),
        ("command_delay", "I", 1e-3),
    ],
)
def test_effects_outside_the_equations_deviate_too(effect, channel, least):
    if channel == "p2":
        channel = next(iter(trial(effect).sizes)).removeprefix("b_").removeprefix("g_")
    apart = run(effect, 0.15)[channel] - run(effect, 0.0)[channel]
    assert np.max(np.abs(apart)) > least


def test_the_true_parameters_leave_no_gap():
    assert held_out_gap(recordings(), trial().parameters) == pytest.approx(1.0, abs=1e-3)


def test_a_parameter_that_is_off_is_beyond_what_units_scatter():
    """4 % more preload: neither the four nor any unit of the nominal design follows that."""
    unit = trial().unit
    off = replace(trial(), sizes={"xPV0": 1.04 * unit["xPV0"]})
    true = true_recordings(off, 0, QUICK_SUITE)
    assert explainable_gap(replace(off, kind=ONE_CAUSE), true) > 1.5
