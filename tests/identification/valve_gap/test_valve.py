"""The valve behind the protocol, and a diagnosis of bench recordings whose effect is known here."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.common.law_form import KNOTS
from epv_env.plant.channels import SENSORS
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters
from identification.calibration.problem import calibration_problem
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.fit.evidence import percentage_errors, with_settled_runs
from identification.gap.fit.fitting_problem import FittingProblem, Hypothesis
from identification.gap.judge.verdict import Ranking
from identification.gap.prepare.prepared_plant import prepared
from identification.recordings.recording import OUTPUTS, UNITS, Campaign
from identification.replay.replay import responses, total_response_error
from identification.validation import validate
from identification.valve_gap.causes import effects, parameters
from identification.valve_gap.valve import Valve
from tests.identification.disturbances import add_ripple, round_pressures
from tests.identification.twins import twin
from tests.identification.valve_gap.campaigns import MANY, all_but, campaign

NAMES = ("test1", "test4", "low_supply", "validation", "rest")


def test_every_effect_of_the_plant_is_a_cause_with_a_component():
    assert {cause.name for cause in effects()} == set(CATALOGUE)
    for cause in effects() + parameters(Parameters.calibrated()):
        assert cause.sizes, cause.label
        for parameter in cause.parameters:
            assert parameter.low < parameter.high
            # What is no size weighs the form, and has a prior about the form that is assumed.
            assert parameter.trials or np.isfinite(parameter.sd), cause.label
            inside = [parameter.low <= trial <= parameter.high for trial in parameter.trials]
            assert all(inside), cause.label


def test_outputs_are_the_replay_s():
    valve = Valve(campaign(*NAMES))
    plain = {"R": np.array([valve.base["R"]])}
    for answer, output in zip(
        responses(valve.recordings, valve.base), valve.outputs(plain, range(4)), strict=True
    ):
        np.testing.assert_array_equal(answer.model, output[:, :, 0])


def test_a_noise_that_is_told_counts_and_the_others_are_estimated():
    estimated, told = Valve(campaign(*NAMES)), Valve(campaign(*NAMES), noise={"p3": 7e3})
    assert {c.name: c.noise for c in told.channels} == {
        c.name: 7e3 if c.name == "p3" else c.noise for c in estimated.channels
    }


def test_wild_readings_reach_neither_the_model_nor_the_fit():
    clean = Valve(campaign(*NAMES))
    spikes = {"U": (30, -20.0), "p1": (600, 3e5), "p2": (20, 2e5), "p3": (400, -1e5), "I": (40, 0.05)}

    def spoilt(recording):
        changed = {name: recording.channel(name).copy() for name in spikes}
        for name, (sample, size) in spikes.items():
            changed[name][sample] += size
        return replace(recording, **changed)

    wild = Valve(
        replace(campaign(*NAMES), recordings=tuple(spoilt(r) for r in campaign(*NAMES).recordings))
    )
    found = {(own.file, own.channel): own.samples for own in wild.screened}
    expected = {
        (f"{r.name}.csv", name): (s,)
        for r in campaign(*NAMES).recordings
        for name, (s, _) in spikes.items()
    }
    assert found == expected
    assert not clean.screened
    for run, original in zip(wild.runs, clean.runs, strict=True):
        assert not np.any(run.trusted[[0, 1, 2], [spikes[name][0] for name in OUTPUTS]])
        assert np.sum(original.trusted & ~run.trusted) <= len(OUTPUTS)
    nominal = {"R": np.array([clean.base["R"]])}
    for own, exact in zip(
        wild.outputs(nominal, range(4)), clean.outputs(nominal, range(4)), strict=True
    ):
        noise = np.array([channel.known_noise for channel in clean.channels])
        assert np.all(np.abs(own - exact) < noise[:, None, None])


@pytest.mark.parametrize("noise", [{"p3": 0.0}, {"p3": float("nan")}, {"p1": 1e3}])
def test_what_is_no_noise_of_an_output_is_refused(noise):
    with pytest.raises(ValueError, match="give a positive standard deviation"):
        Valve(campaign(*NAMES), noise=noise)


def test_numbers_of_one_run_leave_the_others_alone():
    valve = Valve(campaign(*NAMES))
    own = np.zeros((2, 4))
    own[1, 2] = 10.0
    values = {"R": np.full(2, valve.base["R"]), "theta_coil": own, "I_zero": np.array([0.0, 1e-3])}
    for run, output in enumerate(valve.outputs(values, range(4))):
        change = output[2, :, 1] - output[2, :, 0]
        np.testing.assert_allclose(output[0, :5, 1], output[0, :5, 0])
        if run == 2:
            assert change[0] < -0.01
        else:
            np.testing.assert_allclose(change, 1e-3)


def test_a_constant_law_is_a_larger_cause():
    valve = Valve(campaign(*NAMES))
    (friction,) = (cause for cause in valve.causes if cause.label == "piston_friction")
    law = valve.law_values(1, friction, "p3", 1e5, 9e5, np.full(KNOTS, 0.5))
    values = {"F_PV": 4.0} | law
    found = valve.outputs({symbol: np.array([value]) for symbol, value in values.items()}, [0])[0]
    expected = valve.outputs({"F_PV": np.array([6.0])}, [0])[0]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert not np.allclose(found, valve.outputs({"F_PV": np.array([4.0])}, [0])[0], rtol=1e-4)


def diagnosed(causes: tuple[str, ...], **effect: float):
    return rank_hypotheses(Valve(campaign(*NAMES, **effect), without=all_but(*causes)))


CANDIDATES = ("eddy_current", "flyback_voltage", "moving_control_volume", "parameter:cPV", "seat_leak")


def test_an_effect_of_the_bench_is_found():
    found = diagnosed(CANDIDATES, sV3=0.5)
    assert found.hypotheses[0].labels == ("moving_control_volume",)
    assert found.probabilities[0] > 0.9
    assert found.problem.values(found.hypotheses[0].estimate)["sV3"] == pytest.approx(0.5, rel=0.05)


def test_a_bench_without_an_effect_has_no_gap():
    found = diagnosed(CANDIDATES)
    assert found.no_cause > 0.8


def test_percent_is_the_validation_stage_s():
    valve = Valve(campaign(*NAMES))
    nominal = {"R": np.array([valve.base["R"]])}
    outputs = [y[..., 0] for y in valve.outputs(nominal, range(len(valve.runs)))]
    found = percentage_errors(valve, outputs)
    answers = validate(calibration_problem(campaign(*NAMES)), valve.base).answers
    assert found is not None
    assert found["overall"] == pytest.approx(100 * total_response_error(answers), rel=1e-9)
    for channel in valve.channels:
        each = [answer.errors[channel.name] for answer in answers]
        assert found[channel.name] == pytest.approx(100 * np.sqrt(np.mean(np.square(each))), rel=1e-9)


def test_coarse_steps_warn_and_widen_what_is_read_off_the_hold():
    fine, coarse = Valve(twin()), Valve(round_pressures(twin(), 0.05))
    assert fine.warnings == []
    assert "p2 50 mbar" in coarse.warnings[0]
    start = coarse.run_offsets[0]
    assert start.symbol == fine.run_offsets[0].symbol
    assert start.sd == pytest.approx(np.hypot(fine.run_offsets[0].sd, 5e3 / np.sqrt(12)))


WARM, H_COIL = 40.0, 0.02
"""How much warmer the winding begins [K], and its heating [K/J]."""


def test_every_run_finds_its_own_warmth():
    """From readings without noise: run parameters suit held-out runs, too, though nothing is linear."""
    plant = prepared(Valve(campaign("test1", "low_supply", "validation")))
    assert {run.held_out for run in plant.runs} == {False, True}
    heating = next(cause for cause in plant.causes if cause.name == "coil_heating")
    (start,) = heating.run_parameters
    values = {"h_coil": np.array([H_COIL]), start.symbol: np.full((1, len(plant.runs)), WARM)}
    read = plant.outputs(values, range(len(plant.runs)))
    plant.runs = tuple(replace(run, measured=y[..., 0]) for run, y in zip(plant.runs, read, strict=True))
    problem = FittingProblem(plant)
    cold = problem.start(Hypothesis(causes=(heating,)), {"h_coil": H_COIL})
    found = start.centre + with_settled_runs(problem, cold).run_values[:, 0]
    assert found == pytest.approx(WARM, rel=0.01)


RIPPLE = {name: 2.0 * SENSORS[name].noise for name in ("p1", "p2", "p3")}
"""Twice the sensors' noise."""

LONG = ("test1", "low_supply", "long_open", "high_voltage", "validation", "steps")
"""Recordings of a campaign: enough blocks to see a ripple, and half as long as the whole suite."""


def rippled(recorded: Campaign) -> Campaign:
    return add_ripple(recorded, sd=RIPPLE, correlation_time=0.02, seed=1)


def ranked(disturbed: Campaign) -> Ranking:
    return rank_hypotheses(Valve(disturbed, without=all_but("eddy_current", *MANY)))


def test_pressures_in_steps_of_50_mbar_show_no_gap():
    found = ranked(round_pressures(campaign(*LONG), 0.05))
    assert found.no_cause > found.unknown
    assert max(found.inclusion.values()) < 0.05


def test_a_slow_ripple_on_the_pressures_is_no_gap_and_is_filtered():
    found = ranked(rippled(campaign(*LONG)))
    assert found.no_cause > 0.5
    plant = prepared(found.problem.plant)
    seen = {
        c.name: r.sd * c.known_noise for c, r in zip(plant.channels, plant.ripples, strict=True) if r
    }
    expected = {name: RIPPLE[name] * UNITS[name][1] for name in ("p2", "p3")}
    assert seen == pytest.approx(expected, rel=0.25)


def test_a_true_effect_is_found_under_a_slow_ripple():
    assert ranked(rippled(campaign(*LONG, G_eddy=4e-3))).inclusion["eddy_current"] > 0.9
