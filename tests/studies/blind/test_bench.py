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


def test_without_an_effect_the_bench_is_the_nominal_plant():
    unit = trial().unit
    nominal = bench.run_programme(unit, SHORT).channels
    found = run_programme(unit, SHORT, form_deviation=0.0, rng=np.random.default_rng(0)).channels
    for name, least in (("p1", 50.0), ("p2", 50.0), ("p3", 50.0), ("I", 5e-5)):
        np.testing.assert_allclose(found[name], nominal[name], atol=least)


def test_the_true_parameters_leave_no_gap():
    assert held_out_gap(recordings(), trial().parameters) == pytest.approx(1.0, abs=1e-3)


def test_a_parameter_that_is_off_is_beyond_what_units_scatter():
    """4 % more preload: neither the four nor any unit of the nominal design follows that."""
    unit = trial().unit
    off = replace(trial(), sizes={"xPV0": 1.04 * unit["xPV0"]})
    true = true_recordings(off, 0, QUICK_SUITE)
    assert explainable_gap(replace(off, kind=ONE_CAUSE), true) > 1.5
