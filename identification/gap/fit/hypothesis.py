"""Hypotheses, and estimates of their parameters."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Causes that are taken to act together; without causes: the recalibrated nominal model."""

    causes: tuple[Cause, ...]

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters of all causes, which are fitted beside the calibrated parameters."""
        return tuple(parameter for cause in self.causes for parameter in cause.parameters)

    @property
    def run_parameters(self) -> tuple[NuisanceParameter, ...]:
        """Nuisance parameters of all causes that take a separate value in every run."""
        return tuple(nuisance for cause in self.causes for nuisance in cause.run_parameters)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the causes."""
        return tuple(cause.label for cause in self.causes)

    @property
    def titles(self) -> tuple[str, ...]:
        """The causes for people."""
        return tuple(cause.title for cause in self.causes)


@dataclass(frozen=True, kw_only=True)
class NuisanceSlopes:
    """Derivatives of the outputs by run offsets and tolerances, which enter the fits linearly."""

    deviations: NDArray
    """Tolerances of the simulations at which they hold, (m,) [standard deviations from the centres]."""
    offset_slopes: list[NDArray]
    """Per run: derivatives by the run offsets, (values, offsets) [noise deviations/SI]."""
    tolerance_slopes: list[NDArray]
    """Per run: derivatives by the tolerances, (values, m) [noise deviations/standard deviation]."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Parameter values of a hypothesis: the start, an intermediate result or the result of a fit."""

    hypothesis: Hypothesis
    vector: NDArray
    """Calibrated parameters, then parameters of the causes, each divided by its scale, (k,) [1]."""
    run_values: NDArray
    """Run parameters of the causes less their centres, (runs, l) [SI]."""
    slopes: NuisanceSlopes | None = None
    """Nuisance slopes taken at this estimate; None: those of the fitting problem."""
    chi_square: float = np.inf
    """Weighted sum of squares on the fitted runs, infinite before a fit [1]."""
    converged: bool = False
    given_up: bool = False
    """True where a rival hypothesis fits so much better that the fit was stopped."""

    @property
    def cause_start(self) -> int:
        """Index of the vector at which the parameters of the causes begin."""
        return len(self.vector) - len(self.hypothesis.parameters)

    @property
    def cause_vector(self) -> NDArray:
        """Scaled parameters of the causes, (parameters of causes,) [1]."""
        return self.vector[self.cause_start :]


def cause_places(estimate: Estimate) -> list[tuple[Cause, slice, slice]]:
    """Each cause with the places of its parameters in the vector and of its run parameters."""
    places = []
    first, first_run = estimate.cause_start, 0
    for cause in estimate.hypothesis.causes:
        end, end_run = first + len(cause.parameters), first_run + len(cause.run_parameters)
        places.append((cause, slice(first, end), slice(first_run, end_run)))
        first, first_run = end, end_run
    return places


def nominal_vector(cause: Cause) -> NDArray:
    """Scaled parameters of a cause that does not act, (parameters,) [1]."""
    return np.array([parameter.nominal / parameter.scale for parameter in cause.parameters])
