"""The control aims' figures, against episodes whose figures are known."""

import numpy as np
import pytest

from training.metrics import Meter

PERIOD = 0.1


def run(deviations, settling_time=0.0, failed=None):
    """The metrics of one episode with these deviations [bar], a switching and 1 mg in each period."""
    meter = Meter(1, PERIOD, settling_time)
    for k, deviation in enumerate(deviations):
        info = {
            "deviation_bar": np.array([deviation]),
            "switchings": np.array([1]),
            "vented_g": np.array([1e-3]),
        }
        meter.update(np.array([-1.0]), np.array([failed == k]), info)
    return meter.result()


def test_figures_of_a_known_episode():
    m = run([0.1, -0.3, -0.4, 0.2])
    assert m.excursion_bar[0] == pytest.approx(0.4)
    assert m.breakdown_bar[0] == pytest.approx(0.4)
    assert m.recovery_s[0] == pytest.approx(2 * PERIOD)
    assert m.rms_bar[0] == pytest.approx(np.sqrt((0.01 + 0.09 + 0.16 + 0.04) / 4))
    assert m.switchings_per_s[0] == pytest.approx(1 / PERIOD)
    assert m.vented_g_per_s[0] == pytest.approx(1e-3 / PERIOD)
    assert m.episode_return[0] == -4.0
    assert m.stayed[0]


def test_what_happens_before_settling_does_not_count():
    assert run([-3.0, 0.1], settling_time=PERIOD).stayed[0]
    assert not run([0.1, -3.0], settling_time=PERIOD).stayed[0]


def test_overshoot_is_an_excursion_but_no_breakdown():
    m = run([0.6])
    assert not m.stayed[0]
    assert m.breakdown_bar[0] == 0.0


def test_a_failed_episode_has_not_stayed():
    assert not run([0.0, 0.0], failed=1).stayed[0]
