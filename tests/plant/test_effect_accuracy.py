"""The default step agrees with short ones under random switching: any valve, each effect at its top."""

import numpy as np

from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import Region
from epv_env.plant.runge_kutta import DEFAULT_STEP
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

MILLIBAR = 100.0  # Pa
PERIODS, PERIOD = 120, 5e-3
EACH = 4
"""Valves with the same effect, each switched at random."""
FINE = 25e-6
WITHIN = 0.2
"""Largest difference of a pressure [mbar]; all but the bouncing armature stay below half of it."""

TOPS = {"+".join(size.symbol for size in sizes): sizes for e in EFFECTS for sizes in e.drawn}


def top(size: Size) -> float:
    """The drawn size with the greatest effect [SI]."""
    assert size.drawn is not None
    return size.drawn[0] if size.stronger_when_smaller else size.drawn[1]


def pressures(
    plants: list[Parameters], step: float = DEFAULT_STEP, periods: int = PERIODS
) -> np.ndarray:
    """p2 and p3 of EACH valves of each plant under consumption, (periods, 2, plants, EACH) [Pa]."""
    n = EACH * len(plants)
    every = {symbol: np.repeat([p[symbol] for p in plants], EACH) for symbol in plants[0]}
    first = energised(every, p1=np.full(n, 11e5), p2=np.full(n, 8e5), U=24.0)
    valves = Valves.started(n, every, first, step=step)
    rng, on, found = np.random.default_rng(0), np.full(EACH, True), []
    for _ in range(periods):
        on ^= rng.random(EACH) < 0.2
        valves.inputs.U[:] = np.tile(np.where(on, 24.0, 0.0), len(plants))
        valves.inputs.sigma_S[:] = np.tile(np.where(rng.random(EACH) < 0.3, 4e-3, 0.0), len(plants))
        valves.advance(PERIOD)
        found.append([valves.state.p2.copy(), valves.state.p3.copy()])
    return np.array(found).reshape(periods, 2, len(plants), EACH)


def test_the_default_step_is_fine_enough_for_each_effect():
    plants = [
        Parameters.calibrated().replace(**{size.symbol: top(size) for size in sizes})
        for sizes in TOPS.values()
    ]
    fine = pressures(plants, FINE)
    assert np.all(np.ptp(fine[:, 0], axis=0).max(axis=1) > 0.1e5)  # the valves did not just stand still
    error = np.abs(pressures(plants) - fine).max(axis=(0, 1, 3)) / MILLIBAR
    assert error.max() < WITHIN, dict(zip(TOPS, error, strict=True))


def test_errors_that_add_up_stay_small():
    """Of 256 valves within 10 %: the figures of docs/explanation/numerical-integration.md."""
    region = Region.named("sensitive_ten_percent", Parameters.calibrated())
    rng = np.random.default_rng(1)
    plants = [region.draw(rng) for _ in range(64)]
    error = (pressures(plants, periods=400) - pressures(plants, 12.5e-6, 400)) / MILLIBAR
    assert np.all(np.abs(error).max(axis=(0, 2, 3)) < (0.5, 0.15)), np.abs(error).max(axis=(0, 2, 3))
    assert np.all(np.sqrt(np.mean(error**2, axis=(0, 2, 3))) < (0.03, 0.015))


def test_steps_four_times_as_long_are_not():
    bouncing = [Parameters.calibrated().replace(eMV=0.75)]
    assert np.abs(pressures(bouncing, 800e-6) - pressures(bouncing, FINE)).max() > WITHIN * MILLIBAR
