"""The adaptive pulse controller finds out which valve it has; the plain pulse controller cannot."""

from typing import Any

import numpy as np
import pytest

from controllers.adaptive_pulse import HARDEST_FLOW, MOST_RESERVE, AdaptivePulse
from controllers.opening_bank import BANK, OpeningBank, shifted
from controllers.opening_pressure import opening_pressure
from controllers.pulse import Pulse
from controllers.pulse_simulation import pulse_table
from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from training.evaluation.hard_scenarios import HARD
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training
PLANT = Parameters.calibrated()
SEEDS = list(range(16))
SETTINGS: dict[str, Any] = {
    "trigger": -0.06,
    "aim": 0.125,
    "filter_time": 0.009,
    "look_ahead": 1.45,
    "rounding": 0.77,
}
ADAPTIVE: dict[str, Any] = {
    **SETTINGS, "caution": 0.3, "doubt": 0.5,
}  # fmt: skip


@pytest.fixture(scope="module")
def table():
    return pulse_table(PLANT)


def twin(offset, gain, pulses, seed=0):
    """A bank after synthetic pulses of a valve with this offset [bar] and gain."""
    rng, bank, one = np.random.default_rng(seed), OpeningBank(1), np.array([0])
    for _ in range(pulses):
        depth = rng.uniform(0.1, 0.8)  # by which the table expects p3 to fall below the opening pressure

        def rise(opening, depth=depth):
            return 0.4 * np.maximum(opening + depth, 0.0)

        noise = rng.normal(0.0, BANK.reading_error)
        foreseen = rise(BANK.offsets)[None, :]
        bank.learn(one, foreseen, np.array([gain * rise(offset) + noise]), np.array([0.01]))
    return bank


def test_before_any_pulse_the_bank_expects_the_nominal_valve():
    bank = OpeningBank(3)
    np.testing.assert_allclose(bank.offset, 0.0, atol=1e-12)
    np.testing.assert_allclose(bank.gain, 1.0)
    np.testing.assert_allclose(bank.offset_deviation, BANK.offset_spread, rtol=0.02)


@pytest.mark.parametrize(("offset", "gain"), [(0.6, 1.2), (-0.3, 0.8)])
def test_pulses_tell_opening_pressure_and_gain(offset, gain):
    bank = twin(offset, gain, pulses=60)
    assert bank.offset[0] == pytest.approx(offset, abs=0.2)
    assert bank.gain[0] == pytest.approx(gain, abs=0.2)
    assert bank.offset_deviation[0] < 0.5 * BANK.offset_spread
    assert bank.gain_deviation[0] < OpeningBank(1).gain_deviation[0]


def test_the_expected_breakdown_is_the_simulated_valves(table):
    """From rest, with the hardest application as the coil is switched off, until the piston lifts."""
    p1, p2, step = 11.0 * BAR, 8.0 * BAR, 0.1e-3
    valves = Valves(1, threads=1)
    valves.set_parameters(np.array([0]), PLANT)
    for field, value in zip(valves.state, energised(PLANT, p1=p1, p2=p2, U=24.0), strict=True):
        field[:] = value
    valves.inputs.U[:] = 0.0
    valves.inputs.sigma_S[:] = HARDEST_FLOW
    while valves.state.xPV[0] == 0:
        valves.advance(step)
    fell = (p2 - valves.state.p2[0]) / BAR
    rest = (np.array([p1, p2 - fell * BAR, p1]) / BAR)[:, None]  # the opening pressure falls with p2
    expected = AdaptivePulse(table=table, **ADAPTIVE).expected_breakdown(table.time_to_open(*rest))
    assert expected[0] == pytest.approx(fell, rel=0.03)


def test_the_reserve_grows_with_the_expected_breakdown_beyond_what_is_tolerated(table):
    controller = AdaptivePulse(table=table, **ADAPTIVE, tolerated=0.4)
    reserve = controller.reserve_for(np.array([0.1, 0.4, 0.6, 9.0]))
    np.testing.assert_allclose(reserve, [0.0, 0.0, 0.2, MOST_RESERVE], atol=1e-12)


def test_a_refill_after_starvation_does_not_carry_p2_out_of_the_band(table):
    scenario = HARD["starved"]
    metrics, _ = run_episodes(
        AdaptivePulse(table=table, **ADAPTIVE), seeds=SEEDS, duration=10.0, options=scenario.all_options
    )
    assert np.all(metrics.stayed)


def test_a_rise_before_the_expected_opening_tells_of_a_higher_opening_pressure():
    bank, one = OpeningBank(2), np.array([0])
    for _ in range(5):
        bank.watch(one, np.array([6.0]), np.array([6.5]), np.array([0.15]))
    assert bank.offset[0] > 0.5
    assert bank.offset[1] == pytest.approx(0.0, abs=1e-12)  # the other valve showed nothing


def test_shifting_the_table_shifts_the_opening_pressure(table):
    p1, p2 = np.full(2, 11.0 * BAR), np.full(2, 8.0 * BAR)
    offset = np.array([0.7, -0.2])
    moved = shifted(table, offset).parameters
    difference = opening_pressure(moved, p1, p2) - opening_pressure(PLANT, p1, p2)
    np.testing.assert_allclose(difference / BAR, offset)


def rms(controller, parameters):
    options = {"parameters": parameters, "scenario": "steps"}
    metrics, _ = run_episodes(controller, seeds=SEEDS, duration=5.0, options=options)
    return np.sqrt(np.mean(metrics.rms_bar**2))


def test_on_another_valve_it_beats_the_pulse_controller_with_the_same_table_and_aims(table):
    soft = {"cPV": 0.9 * PLANT["cPV"], "xPV0": 0.9 * PLANT["xPV0"]}
    adaptive, plain = AdaptivePulse(table=table, **ADAPTIVE), Pulse(table=table, **SETTINGS)
    assert rms(adaptive, soft) < 0.9 * rms(plain, soft)


def test_a_trigger_above_the_aim_is_refused(table):
    with pytest.raises(ValueError, match="give trigger < aim"):
        AdaptivePulse(table=table, **{**ADAPTIVE, "trigger": 0.2})
