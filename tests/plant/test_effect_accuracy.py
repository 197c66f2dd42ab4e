"""Each effect at its top: the default step agrees with steps an eighth as long."""

import numpy as np
import pytest

from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

MILLIBAR = 100.0  # Pa
VALVES, PERIODS, PERIOD = 16, 120, 5e-3
FINE = 25e-6
WITHIN = 0.2
"""Largest difference of a pressure [mbar]; all but the bouncing armature stay below half of it."""

TOPS = [
    pytest.param(sizes, id=f"{effect.name}:{'+'.join(size.symbol for size in sizes)}")
    for effect in EFFECTS
    for sizes in effect.drawn
]


def top(size: Size) -> float:
    """The drawn size with the greatest effect [SI]."""
    assert size.drawn is not None
    return size.drawn[0] if size.stronger_when_smaller else size.drawn[1]


def pressures(p: Parameters, step: float | None) -> np.ndarray:
    """p2 and p3 of valves switched at random under consumption, (periods, 2, valves) [Pa]."""
    valves = Valves(VALVES, threads=1)
    valves.step = step or valves.step
    every = {symbol: np.full(VALVES, value) for symbol, value in p.items()}
    valves.set_parameters(np.arange(VALVES), every)
    first = energised(every, p1=np.full(VALVES, 11e5), p2=np.full(VALVES, 8e5), U=24.0)
    for field, value in zip(valves.state, first, strict=True):
        field[:] = value
    rng, on, found = np.random.default_rng(0), np.full(VALVES, True), []
    for _ in range(PERIODS):
        on ^= rng.random(VALVES) < 0.2
        valves.inputs.U[:] = np.where(on, 24.0, 0.0)
        valves.inputs.sigma_S[:] = np.where(rng.random(VALVES) < 0.3, 4e-3, 0.0)
        valves.advance(PERIOD)
        found.append([valves.state.p2.copy(), valves.state.p3.copy()])
    return np.array(found)


@pytest.mark.parametrize("sizes", TOPS)
def test_the_default_step_is_fine_enough_for_each_effect(sizes):
    p = Parameters.calibrated().replace(**{size.symbol: top(size) for size in sizes})
    fine = pressures(p, FINE)
    assert np.ptp(fine[:, 0]) > 0.1e5  # the valves did not just stand still
    assert np.abs(pressures(p, None) - fine).max() < WITHIN * MILLIBAR


def test_steps_four_times_as_long_are_not():
    p = Parameters.calibrated().replace(eMV=0.75)
    assert np.abs(pressures(p, 800e-6) - pressures(p, FINE)).max() > WITHIN * MILLIBAR
