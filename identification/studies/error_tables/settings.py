"""Settings of the study of the printed error tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Half widths of uniform deviations: one that all tests share, and one of each test alone."""

    shared: float
    """Half width of the deviation that all tests share, in the quantity's unit."""
    each: float
    """Half width of the further deviation of each test, in the same unit."""

    def draw(self, rng: np.random.Generator, n: int) -> NDArray:
        """Deviations of n tests in the quantity's unit, (n,)."""
        return rng.uniform(-self.shared, self.shared) + rng.uniform(-self.each, self.each, n)


@dataclass(frozen=True, kw_only=True)
class ErrorTableSettings:
    """Judgements of the study, by the stage that uses them."""

    # Test conditions that the report does not print.
    draws: int = 8
    """Sets of test conditions [-]: the fitted ones, and the others drawn about them."""
    voltage: Uncertainty = Uncertainty(shared=1.0, each=0.15)
    """U_on [V]: the supply is set once, the coil's share drifts with its temperature."""
    supply_pressure: Uncertainty = Uncertainty(shared=0.4 * BAR, each=0.1 * BAR)
    """p1 [Pa]."""
    circuit_pressure: Uncertainty = Uncertainty(shared=0.4 * BAR, each=0.3 * BAR)
    """p2 at the start [Pa]: every test leaves more air in the circuit than it found."""
    first_deactivation: Uncertainty = Uncertainty(shared=0.02, each=0.005)
    """Start of the first deactivation [s]; the records begin in steady state."""
    pause: Uncertainty = Uncertainty(shared=0.04, each=0.0)
    """From the end of a deactivation to the start of the next [s]."""
    validation_pause_share: float = 0.5
    """Share of `pause` in the validation test [-], where three pulses must fit into 0.75 s."""
    duration: Uncertainty = Uncertainty(shared=0.03, each=0.0)
    """Duration of tests 1 to 4 [s]: the axes of Figures 10 to 13 end between 0.6 and 0.7 s, and between
    1.0 and 1.1 s."""
    winding_temperature: Uncertainty = Uncertainty(shared=0.0, each=1.0)
    """Relative deviation of each test's winding temperature [-]: the coil is not always equally warm."""

    # Sizes at which a cause is tried, as shares of the way from off to an end of the range [-].
    single_size_shares: tuple[float, ...] = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
    """For an effect that one parameter sizes."""
    combined_size_shares: tuple[float, ...] = (1 / 16, 1 / 4, 1.0)
    """For each parameter of an effect that several size; every combination is tried."""
    combined_two_sided_shares: tuple[float, ...] = (1 / 4, 1.0)
    """The same for a parameter whose range has two ends away from off."""
    parameter_shares: tuple[float, ...] = (1 / 8, 1 / 4, 1 / 2, 1.0)
    """For a parameter outside the calibrated four, from its value to each end of its range."""
    winding_deviations: tuple[float, ...] = (2.5, 5.0, 10.0, 20.0, 40.0)
    """Largest deviation of a test's winding temperature from the mean of the tests [K]."""
    current_lags: tuple[float, ...] = (2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3)
    """Time constants of the current's measurement [s]."""

    # Recalibration by Levenberg-Marquardt.
    difference_step: float = 1e-3
    """Relative change of a parameter for a finite difference [-]."""
    iterations: int = 5
    """Trial steps of each fit [-]."""
    converged_decrease: float = 5e-3
    """Relative decrease of the sum of squares at which a fit ends [-]: a quarter of a percent of an
    error."""
    largest_step: float = 0.3
    """Largest relative change of a parameter in one step [-]; farther away the derivatives say
    nothing."""
    parameter_bounds: tuple[float, float] = (1 / 3, 3.0)
    """Bounds of the parameters relative to Table 12 [-]. Their ranges are narrower. But the study
    compares the pattern of errors that is left, and a cause that scales a parameter leaves the same
    pattern at every scale."""
    initial_damping: float = 1e-3
    """Marquardt's damping at the start [-]."""
    damping_factors: tuple[float, float] = (0.1, 10.0)
    """Factor of the damping after a step that succeeds, and after one that fails [-]."""
    valves_at_once: int = 64
    """Valves that are fitted together [-]: about 100 MB."""
    error_limit: float = 1e4
    """Replaces the error of a valve that cannot be integrated [%]."""

    # Ranking.
    tolerance: float = 1.75
    """Typical factor up to which predicted errors explain printed ones [-]. The printed error of p2
    falls by factors of 2.0 and 1.7 between tests that differ by 10 ms of pulse. No smooth cause gives
    that."""
    condition_share: float = 0.1
    """Share of the conditions under which a cause must explain the table [-], and under which it must be
    as near as the nearest cause for both to be inseparable."""
    inseparable_ratio: float = 1.1
    """Ratio of two typical factors that separates no causes [-]: the grid of sizes alone moves the
    factors as much."""
    interval_quantiles: tuple[float, float] = (0.1, 0.9)
    """Quantiles over the conditions that bound the interval of a typical factor [-]."""

    # Pairs of causes.
    simulated_pairs: int = 12
    """Nearest pairs that are simulated together [-]."""
    largest_pair_error: float = 30.0
    """A cause that alone gives a larger error is no member of a pair [%]."""

    # Reliability of the ranking.
    known_tables: int = 150
    """Made-up tables of two known causes [-]."""
    kernel_widths: tuple[float, ...] = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
    """Widths of the kernel over misfits that are tried [-]."""
    current_error_range: tuple[float, float] = (3.0, 12.0)
    """Largest error of I in a made-up table [%], least and most."""
    pressure_error_range: tuple[float, float] = (0.8, 6.0)
    """Largest errors of p2 and of p3 in a made-up table [%], least and most."""
    table_attempts: int = 100_000
    """Attempts to draw a made-up table whose errors lie in these ranges [-]."""
    judging_conditions: int = 3
    """Sets of conditions that judge a made-up table, its own excluded [-]."""
    probability_floor: float = 1e-6
    """Least probability that enters a logarithmic score [-]."""
    set_probability: float = 0.9
    """Probability that the smallest set of causes holds [-]."""


DEFAULTS = ErrorTableSettings()
"""The settings of docs/results/error-tables.md."""
