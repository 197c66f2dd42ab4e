"""The valve's description of recordings in coarse steps says so and trusts the start less."""

import numpy as np
import pytest

from identification.bench.session import round_pressures
from identification.valve_gap.valve import Valve
from tests.identification.twins import twin


def test_coarse_steps_warn_and_widen_what_is_read_off_the_hold():
    fine, coarse = Valve(twin()), Valve(round_pressures(twin(), 0.05))
    assert fine.warnings == []
    assert "p2 50 mbar" in coarse.warnings[0]
    start = coarse.run_offsets[0]
    assert start.symbol == fine.run_offsets[0].symbol
    assert start.sd == pytest.approx(np.hypot(fine.run_offsets[0].sd, 5e3 / np.sqrt(12)))


def test_every_pressure_has_at_least_the_rounding_as_noise():
    noise = {c.name: c.known_noise for c in Valve(round_pressures(twin(), 0.05)).channels}
    assert min(noise["p2"], noise["p3"]) >= 5e3 / np.sqrt(12) * (1 - 1e-9)
