"""The blind check's recordings, and the gaps of models against the noise-free truth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from identification.bench import session as bench
from identification.recordings.recording import OUTPUTS
from identification.studies.blind.bench import blind_suite, run_programme, true_recordings
from identification.studies.blind.commitments import (
    explainable_gap,
    noise_free_recordings,
    packed_recordings,
    unpacked_recordings,
)
from identification.studies.blind.effect_draws import top_sizes
from identification.studies.blind.gap_reduction import true_gap_reduction
from identification.studies.blind.kinds import NOMINAL, ONE_CAUSE
from identification.studies.blind.noise_free_gap import (
    held_out_gap,
    hypothesis_distance,
    recalibrated_parameters,
)
from identification.studies.blind.truth import Trial, draw_trial

SUITE = blind_suite()
SHORT = next(programme for programme in SUITE if programme.name == "test1")


@cache
def recordings(effect=""):
    return noise_free_recordings(true_recordings(trial(effect), 0))


def trial(effect="") -> Trial:
    return draw_trial(7, 0, ONE_CAUSE if effect else NOMINAL, [effect] if effect else [])


def run(effect, deviation):
    rng = np.random.default_rng(0)
    return run_programme(trial(effect).parameters, SHORT, form_deviation=deviation, rng=rng).channels


def test_the_suite_is_nine_recordings_of_a_valve_at_work_of_which_two_are_held_out():
    assert len([programme for programme in SUITE if programme.U_on]) == 9
    held_out = [programme.name for programme in SUITE if programme.role == "validation"]
    assert held_out == ["validation", "steps"]


def test_without_an_effect_the_bench_is_the_nominal_plant():
    unit = trial().unit
    nominal = bench.run_programme(unit, SHORT).channels
    found = run_programme(unit, SHORT, form_deviation=0.0, rng=np.random.default_rng(0)).channels
    for name, least in (("p1", 50.0), ("p2", 50.0), ("p3", 50.0), ("I", 5e-5)):
        np.testing.assert_allclose(found[name], nominal[name], atol=least)


@pytest.mark.parametrize(
    ("effect", "channel", "least"),
    [("supply_restriction", "p2", 1e3), ("magnetic_saturation", "I", 1e-3)],
)
def test_other_forms_are_the_plant_without_the_effect_and_another_with_it(effect, channel, least):
    """The deviations of the recordings: within the solver's tolerance without, well above noise with."""
    top = trial().unit.replace(**top_sizes(effect))
    for valve, same in ((trial().unit, True), (top, False)):
        fitted, other = (
            run_programme(
                valve, SHORT, form_deviation=0.0, rng=np.random.default_rng(0), other_forms=forms
            ).channels[channel]
            for forms in ((), (effect,))
        )
        apart = np.max(np.abs(other - fitted))
        assert apart < 0.05 * least if same else apart > least


@pytest.mark.parametrize(
    ("effect", "channel", "least"),
    [
        ("pressure_sensor_bias", "p2", 20.0),
        ("current_sensor_gain", "I", 1e-5),
        ("command_delay", "I", 1e-3),
    ],
)
def test_effects_outside_the_equations_deviate_too(effect, channel, least):
    if effect == "pressure_sensor_bias":
        channel = "p2" if "b_p2" in trial(effect).sizes else "p3"
    apart = run(effect, 0.15)[channel] - run(effect, 0.0)[channel]
    assert np.max(np.abs(apart)) > least


def test_a_winding_that_heats_begins_each_recording_at_another_temperature():
    p = trial("coil_heating")
    energised = [true for true in heating() if true.programme.U_on]
    start = [true.channels["I"][0] * p.unit["R"] / true.programme.U_on for true in energised]
    assert len(set(start)) == len(energised)
    assert max(start) < 1.0


@cache
def heating():
    return true_recordings(trial("coil_heating"), 0)


def test_the_true_parameters_leave_no_gap():
    assert held_out_gap(recordings(), trial().parameters) == pytest.approx(1.0, abs=1e-3)


def test_a_unit_of_the_nominal_design_leaves_nothing_to_explain():
    fitted = recalibrated_parameters(recordings(), with_scatter=True)
    assert held_out_gap(recordings(), fitted) == pytest.approx(1.0, abs=2e-3)
    four = held_out_gap(recordings(), recalibrated_parameters(recordings(), with_scatter=False))
    assert four > held_out_gap(recordings(), fitted)


def test_an_effect_leaves_something():
    assert explainable_gap(trial("flow_force"), recordings("flow_force"))["explainable"] > 1.05


def test_more_of_the_winding_s_warmth_is_found_per_recording():
    """The model with the true heating closes a gap that it leaves where the start is held cold."""
    true = noise_free_recordings(heating())
    p = trial("coil_heating").parameters
    assert held_out_gap(true, p) < 1.5 < held_out_gap(true, p.replace(h_coil=0.0))


def test_what_is_packed_comes_back_and_is_what_is_held_out():
    found = unpacked_recordings(packed_recordings(recordings()))
    held_out = [recording for recording in recordings() if recording.held_out]
    assert [r.name for r in found] == [r.name for r in held_out]
    for one, other in zip(found, held_out, strict=True):
        assert one.period == other.period
        for name in ("U", "p1", *OUTPUTS):
            np.testing.assert_array_equal(one.channels[name], other.channels[name])
    assert packed_recordings(recordings()) == packed_recordings(recordings())


def test_half_the_noise_is_twice_the_gap():
    """The gap is in noise deviations: a constant error of a current counts by its size."""
    true = [r for r in recordings() if r.held_out]
    off = [
        [replace(r, channels={**r.channels, "I": r.channels["I"] + shift}) for r in true]
        for shift in (1e-3, 2e-3)
    ]
    one, two = (held_out_gap(each, trial().parameters) ** 2 - 1 for each in off)
    assert two / one == pytest.approx(4.0, rel=0.05)


def test_a_parameter_that_is_off_is_beyond_what_units_scatter():
    """4 % more preload: neither the four nor any unit of the nominal design follows that."""
    unit = trial().unit
    off = replace(trial(), sizes={"xPV0": 1.04 * unit["xPV0"]})
    true = noise_free_recordings(true_recordings(off, 0))
    assert explainable_gap(replace(off, kind=ONE_CAUSE), true)["explainable"] > 1.5


def test_more_turns_are_hardly_told_from_a_shorter_magnetic_circuit_but_well_from_a_stiffer_spring():
    """The core's inductance knows turns and length by one quotient; the spring works elsewhere."""
    truth = recordings("parameter:N")
    turns, nominal = trial("parameter:N").sizes["N"], Parameters.calibrated()
    off = turns / nominal["N"]
    own, twin = (
        hypothesis_distance(truth, start) for start in ({"N": turns}, {"dMB": nominal["dMB"] / off})
    )
    assert max(own, twin) < 1.0
    assert hypothesis_distance(truth, {"cMV": 1.05 * nominal["cMV"]}) > 10.0


def test_a_biased_start_of_the_circuit_is_read_with_its_bias():
    biased = replace(trial(), sizes={"b_p2": 1e4})
    true = noise_free_recordings(true_recordings(biased, 0))
    assert held_out_gap(true, biased.parameters) == pytest.approx(1.0, abs=2e-3)
    assert held_out_gap(true, biased.unit) > 1.5


def answer(**parameters):
    """What a diagnosis of the jet's force may say, with an interval of 0.9 to 1."""
    shrink = {"fraction": 0.95, "low": 0.9, "high": 1.0}
    return {
        "verdict": "known",
        "causes": [{"effects": ["flow_force"], "magnitude": {}, "shrink": shrink}],
        "parameters": parameters,
    }


def test_the_true_gap_reduction_is_that_of_the_reported_parameters():
    """The truth closes nearly all that its deviating form leaves open; recalibration closes nothing."""
    true = recordings("flow_force")
    four = dict(recalibrated_parameters(true, with_scatter=False))
    full = true_gap_reduction(
        answer(recalibrated=four, with_cause=dict(trial("flow_force").parameters)), true
    )
    none = true_gap_reduction(answer(recalibrated=four, with_cause=four), true)
    assert full is not None
    assert none is not None
    assert 0.9 < full.true <= 1.0
    assert full.inside
    assert none.true == pytest.approx(0.0)
    assert not none.inside
    assert true_gap_reduction({"verdict": "no_gap", "causes": []}, true) is None
