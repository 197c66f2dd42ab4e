"""The supply: compressors cycle, slopes and recordings are followed, what cannot be is refused."""

import numpy as np
import pytest

from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.supply import Supply, two_point
from epv_env.plant.valves import Valves

P = Parameters.calibrated()
RT = P["R_gas"] * P["T_env"]


def test_an_imposed_slope_is_followed_exactly():
    """While the valve fills its circuit."""
    valves = Valves.started(1, P, energised(P, p1=9e5, p2=5e5, U=24.0))
    valves.inputs.p1_slope[:] = -1e5
    valves.advance(0.3)
    assert valves.state.p1 == pytest.approx(9e5 - 0.3e5, rel=1e-13)


def test_a_compressor_cycles_between_its_thresholds():
    """Under a constant draw below its delivery, the pressure saws between cut-in and cut-out."""
    supply = Supply.reservoirs()
    p1, runs, seen = 11e5, False, []
    for _ in range(4000):
        runs = two_point(p1, runs, supply.cut_in, supply.cut_out)
        p1 = p1 + 0.1 * RT / supply.volume * (supply.delivery * runs - 2e-3)
        seen.append(p1)
    assert min(seen) == pytest.approx(10.5e5, abs=300)
    assert max(seen) == pytest.approx(12.5e5, abs=400)
    assert np.sum(np.diff(np.sign(np.diff(seen))) != 0) > 3


def test_first_pressures_are_drawn_from_the_range():
    rng = np.random.default_rng(0)
    drawn = [Supply.reservoirs((9.0, 10.0)).draw(rng) / BAR for _ in range(500)]
    assert (min(drawn), max(drawn)) == pytest.approx((9.0, 10.0), abs=0.01)
    assert Supply.constant(8.0).draw(rng) == 8 * BAR


def test_slopes_of_a_recording_lead_along_it():
    time, pressure = np.array([0.0, 0.1, 0.25, 0.4]), np.array([9.0, 9.6, 7.0, 8.0])
    supply = Supply.recorded(time, pressure)
    starts = np.arange(0, 0.6, 0.02)
    p1 = supply.draw(np.random.default_rng(0)) + np.cumsum(0.02 * supply.slope(starts, 0.02))
    expected = np.interp(starts + 0.02, time, pressure) * BAR
    np.testing.assert_allclose(p1, expected, rtol=1e-13)


@pytest.mark.parametrize(
    ("time", "pressure"),
    [([], []), ([0.0, 1.0], [9.0, -5.0]), ([0.0, 1.0], [9.0, np.nan]), ([0.0, np.nan], [9.0, 9.0])],
)
def test_a_recording_without_positive_pressures_is_refused(time, pressure):
    with pytest.raises(ValueError, match="recorded supply"):
        Supply.recorded(time, pressure)


@pytest.mark.parametrize("wrong", [{"volume": 0.0}, {"volume": -1.0}, {"delivery": -1.0}], ids=str)
def test_reservoirs_without_volume_and_negative_deliveries_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Supply(pressure=(9e5, 9e5), **wrong)
