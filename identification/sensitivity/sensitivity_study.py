"""The whole sensitivity study in one call."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from identification.sensitivity.collinearity import OutputSensitivities, sensitivities_of_outputs
from identification.sensitivity.fixed_step import simulate_fixed_step
from identification.sensitivity.global_indices import (
    MorrisEffects,
    SobolIndices,
    morris_effects,
    ranges,
    sobol_indices,
    total_error_model,
)
from identification.sensitivity.one_at_a_time import ErrorSensitivity, sensitivities, studied_symbols
from identification.sensitivity.report_conditions import REPORT_CONDITIONS, StudyConditions
from identification.sensitivity.settings import SENSITIVITY, SensitivitySettings

FIXED_STEP_CONDITIONS = replace(REPORT_CONDITIONS, U_on=18.835)
"""The conditions for the fixed step, whose scatter changes within 0.02 V: this voltage, 0.065 V below
the fitted one, lies amid 0.01 V where every class is as printed
(docs/studies/reproduction/README.md)."""


@dataclass(frozen=True, kw_only=True)
class OneAtATime:
    """Tables 8 and 9, computed three ways; by symbol."""

    fixed_step: Mapping[str, ErrorSensitivity]
    """As the report most likely simulated: a fixed step of 0.5 ms."""
    exact: Mapping[str, ErrorSensitivity]
    """With the plant's own integrator, which locates every stop."""
    scatter: Mapping[str, NDArray]
    """Total errors with the fixed step at each of `scatter_voltages`, fractions, (voltages, 2)."""


@dataclass(frozen=True, kw_only=True)
class SensitivityStudy:
    """Everything that section 5 asks, and what it left out."""

    one_at_a_time: OneAtATime
    outputs: OutputSensitivities
    screening: MorrisEffects
    indices: SobolIndices


def run_one_at_a_time(
    nominal: Mapping[str, float] | None = None, settings: SensitivitySettings = SENSITIVITY
) -> OneAtATime:
    """Tables 8 and 9 for Tables 5 to 7, or for other nominal values by symbol [SI]."""
    p = nominal or Parameters.nominal()
    symbols = studied_symbols()
    return OneAtATime(
        fixed_step=_fixed_step(p, FIXED_STEP_CONDITIONS),
        exact=sensitivities(p, symbols),
        scatter=_scatter(p, symbols, settings),
    )


def run_sensitivity_study(
    nominal: Mapping[str, float] | None = None,
    *,
    outputs: OutputSensitivities | None = None,
    seed: int | None = None,
    settings: SensitivitySettings = SENSITIVITY,
) -> SensitivityStudy:
    """All studies.

    Args:
        nominal: parameters by symbol [SI]; None: Tables 5 to 7.
        outputs: how the outputs respond on recordings; None: in the report's test cases.
        seed: of Morris's and Sobol's designs; None: the settings' seed.

    Raises SimulationError.
    """
    seed = settings.seed if seed is None else seed
    p = nominal or Parameters.nominal()
    symbols = studied_symbols()
    model = total_error_model(p, symbols, batch=settings.batch)
    bounds = ranges(p, symbols, settings.span)
    return SensitivityStudy(
        one_at_a_time=run_one_at_a_time(p, settings),
        outputs=outputs or sensitivities_of_outputs(p, symbols, settings=settings),
        screening=morris_effects(
            model, symbols, bounds, trajectories=settings.trajectories, seed=seed, settings=settings
        ),
        indices=sobol_indices(
            model, symbols, bounds, samples=settings.samples, seed=seed, settings=settings
        ),
    )


def _fixed_step(p: Mapping[str, float], conditions: StudyConditions) -> dict[str, ErrorSensitivity]:
    symbols = studied_symbols()
    return sensitivities(p, symbols, conditions=conditions, simulator=simulate_fixed_step)


def scatter_voltages(settings: SensitivitySettings = SENSITIVITY) -> NDArray:
    """Voltages over which the scatter of the fixed step is shown [V], (voltages,)."""
    voltages = np.linspace(*settings.scatter_range, settings.scatter_points)
    return np.append(voltages, FIXED_STEP_CONDITIONS.U_on)


def _scatter(
    p: Mapping[str, float], symbols: list[str], settings: SensitivitySettings
) -> dict[str, NDArray]:
    runs = [
        _fixed_step(p, replace(REPORT_CONDITIONS, U_on=float(U))) for U in scatter_voltages(settings)
    ]
    return {
        symbol: np.array([[run[symbol].minus, run[symbol].plus] for run in runs]) for symbol in symbols
    }
