"""The least-squares problem that a plant's recordings pose, and simulations of candidate estimates."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.hypothesis import Estimate, Hypothesis, NuisanceSlopes
from identification.gap.fit.settings import FitSettings
from identification.gap.model.free_parameter import FreeParameter
from identification.gap.model.grey_box import GreyBox, noise_weighted


class FittingProblem:
    """Weighted readings of a plant, with the nuisance slopes that hold for all estimates."""

    def __init__(
        self,
        plant: GreyBox,
        slopes: NuisanceSlopes | None = None,
        settings: FitSettings | None = None,
    ):
        """Weigh the readings of a plant.

        Args:
            plant: the model and its recordings.
            slopes: nuisance slopes of estimates that have none; None: nuisances have no effect.
            settings: judgement of the fits; None: the defaults.
        """
        self.plant = plant
        self.settings = settings or FitSettings()
        self.fitted_runs = [r for r, run in enumerate(plant.runs) if not run.held_out]
        self.all_runs = list(range(len(plant.runs)))
        self.readings = sum(np.count_nonzero(plant.runs[r].trusted) for r in self.fitted_runs)
        self.measured = [
            noise_weighted(plant, r, run.measured).reshape(-1) for r, run in enumerate(plant.runs)
        ]
        """Per run: readings (channels x samples,) [noise deviations]."""
        none = [np.zeros((len(values), 0)) for values in self.measured]
        self.slopes = slopes or NuisanceSlopes(
            deviations=np.zeros(0), offset_slopes=none, tolerance_slopes=none
        )

    def start(self, hypothesis: Hypothesis, values: Mapping[str, float]) -> Estimate:
        """An estimate with values [SI] by symbol; a symbol that is left out has its nominal value."""
        parameters = (*self.plant.parameters, *hypothesis.parameters)
        vector = np.array([values.get(p.symbol, p.nominal) / p.scale for p in parameters])
        run_values = np.zeros((len(self.plant.runs), len(hypothesis.run_parameters)))
        return Estimate(hypothesis=hypothesis, vector=vector, run_values=run_values)

    def parameters(self, estimate: Estimate) -> tuple[FreeParameter, ...]:
        """Parameters of the estimate's vector: the calibrated ones, then those of its causes."""
        return (*self.plant.parameters, *estimate.hypothesis.parameters)

    def values(self, estimate: Estimate) -> dict[str, float]:
        """Calibrated parameters and parameters of causes by symbol [SI]."""
        pairs = zip(self.parameters(estimate), estimate.vector, strict=True)
        return {p.symbol: float(scaled * p.scale) for p, scaled in pairs}

    def candidate(self, estimate: Estimate) -> dict[str, NDArray]:
        """Values by symbol, (1,) or (1, runs) [SI], as `GreyBox` takes one candidate."""
        values = {symbol: np.array([value]) for symbol, value in self.values(estimate).items()}
        run_values = {
            nuisance.symbol: estimate.run_values[None, :, j]
            for j, nuisance in enumerate(estimate.hypothesis.run_parameters)
        }
        return {**values, **run_values}

    def candidates(self, estimates: Sequence[Estimate]) -> dict[str, NDArray]:
        """Values by symbol of n estimates side by side, (n,) or (n, runs) [SI], for `GreyBox`."""
        n = len(estimates)
        columns: dict[str, NDArray] = {}
        for i, estimate in enumerate(estimates):
            for p, scaled in zip(self.parameters(estimate), estimate.vector, strict=True):
                nominal = np.full(n, p.nominal, dtype=float)
                columns.setdefault(p.symbol, nominal)[i] = scaled * p.scale
            run_parameters = estimate.hypothesis.run_parameters
            for nuisance, own in zip(run_parameters, estimate.run_values.T, strict=True):
                centre = np.full((n, len(self.plant.runs)), nuisance.centre)
                columns.setdefault(nuisance.symbol, centre)[i] = own
            # A cause may set the same parameter: the unit's scatter is added to its value.
            deviations = self.slopes_of(estimate).deviations
            tolerances = self.plant.tolerances[: len(deviations)]
            for tolerance, deviation in zip(tolerances, deviations, strict=True):
                centre = np.full(n, tolerance.centre, dtype=float)
                columns.setdefault(tolerance.symbol, centre)[i] += deviation * tolerance.sd
        return columns

    def ends(self, estimate: Estimate) -> tuple[NDArray, NDArray]:
        """Steps of the scaled vector to both ends of the ranges, (k,) each [1]; never across zero."""
        parameters, vector = self.parameters(estimate), estimate.vector
        low = np.array([min(p.low / p.scale, p.high / p.scale) for p in parameters])
        high = np.array([max(p.low / p.scale, p.high / p.scale) for p in parameters])
        return np.minimum(low - vector, 0.0), np.maximum(high - vector, 0.0)

    def slopes_of(self, estimate: Estimate) -> NuisanceSlopes:
        """Nuisance slopes that hold for an estimate."""
        return estimate.slopes or self.slopes

    def outputs(self, estimates: Sequence[Estimate], runs: Sequence[int]) -> list[NDArray]:
        """Weighted outputs of n estimates, per run (values, n) [noise deviations]."""
        outputs = self.plant.outputs(self.candidates(estimates), runs)
        return [
            noise_weighted(self.plant, r, output).reshape(-1, len(estimates))
            for r, output in zip(runs, outputs, strict=True)
        ]

    def residuals(self, estimates: Sequence[Estimate], runs: Sequence[int]) -> list[NDArray]:
        """Weighted measured - model of n estimates, per run (values, n) [noise deviations]."""
        return [self.residual(r, y) for r, y in zip(runs, self.outputs(estimates, runs), strict=True)]

    def residual(self, run: int, outputs: NDArray) -> NDArray:
        """Measured less weighted outputs (values, n) of a run [noise deviations]."""
        return np.nan_to_num(self.measured[run][:, None] - outputs, nan=self.settings.failed_residual)
