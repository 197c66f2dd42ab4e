"""The adaptive pulse controller finds out which valve it has; the plain pulse controller cannot."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from controllers.adaptive_pulse import AdaptivePulse
from controllers.opening_bank import BANK, OpeningBank, shifted
from controllers.opening_pressure import opening_pressure
from controllers.pulse import Pulse
from controllers.pulse_simulation import pulse_table
from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import BEYOND, TUNING_REGION

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


@pytest.mark.parametrize("probability", [0.05, 0.5, 0.9, 0.95])
def test_before_any_pulse_the_quantiles_are_the_normal_distribution_s(probability):
    quantile = OpeningBank(2).offset_quantile(probability)
    expected = norm.ppf(probability, scale=BANK.offset_spread)
    assert quantile == pytest.approx(expected, abs=BANK.offsets[1] - BANK.offsets[0])


@pytest.mark.parametrize(("offset", "gain"), [(0.6, 1.2), (-0.3, 0.8)])
def test_pulses_tell_opening_pressure_and_gain(offset, gain):
    bank = twin(offset, gain, pulses=60)
    assert bank.offset[0] == pytest.approx(offset, abs=0.2)
    assert bank.gain[0] == pytest.approx(gain, abs=0.2)
    assert bank.offset_deviation[0] < 0.5 * BANK.offset_spread
    assert bank.gain_deviation[0] < OpeningBank(1).gain_deviation[0]


def test_a_refill_after_starvation_does_not_carry_p2_out_of_the_band(table):
    scenario = BEYOND["starved"]
    metrics, _ = run_episodes(
        AdaptivePulse(table=table, **ADAPTIVE),
        seeds=SEEDS,
        duration=10.0,
        options={"parameters": TUNING_REGION, **scenario.options},
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
