"""Hypotheses, their estimates, and the least-squares problem that a plant's recordings pose."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.field_types import numbers
from epv_env.common.files import Journal
from identification.gap.fit.laws import Law
from identification.gap.plant import Cause, FreeParameter, GreyBox, NuisanceParameter, noise_weighted


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Causes that are taken to act together; without causes: the recalibrated nominal model."""

    causes: tuple[Cause, ...]
    laws: tuple[Law, ...] = ()
    """Laws of these causes that are open; the others are as assumed."""

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters of the laws, then of all causes; they are fitted beside the calibrated ones."""
        return tuple(p for part in (*self.laws, *self.causes) for p in part.parameters)

    @property
    def cause_parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters of all causes."""
        return tuple(p for cause in self.causes for p in cause.parameters)

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
    calibrated: list[NDArray] | None = None
    """Per run: derivatives by the calibrated parameters, (values, parameters) [noise deviations], which
    fits from here keep as long as they help; None where they are taken anew in each step."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Parameter values of a hypothesis: the start, an intermediate result or the result of a fit."""

    hypothesis: Hypothesis
    vector: NDArray
    """Calibrated parameters, those of laws and of causes, each divided by its scale, (k,) [1]."""
    run_values: NDArray
    """Run parameters of the causes less their centres, (runs, l) [SI]."""
    slopes: NuisanceSlopes | None = None
    """Nuisance slopes taken at this estimate; None: those of the fitting problem."""
    chi_square: float = np.inf
    """Weighted sum of squares on the fitted runs, infinite before a fit [1]."""
    steps: int = 0
    """Steps that its fits have taken."""
    converged: bool = False
    given_up: bool = False
    """True where a rival hypothesis fits so much better that the fit was stopped."""

    @property
    def cause_start(self) -> int:
        """Index of the vector at which the parameters of the causes begin."""
        return len(self.vector) - len(self.hypothesis.cause_parameters)

    @property
    def laws(self) -> list[tuple[Law, NDArray]]:
        """Each law with its components (m,) [standard deviations]."""
        first, found = len(self.vector) - len(self.hypothesis.parameters), []
        for law in self.hypothesis.laws:
            end = first + len(law.parameters)
            found.append((law, self.vector[first:end]))
            first = end
        return found

    @property
    def acting_laws(self) -> list[tuple[Law, NDArray]]:
        """Laws that differ from those assumed, with their components (m,); at most two are simulated."""
        return [(law, components) for law, components in self.laws if np.any(components)]


def cause_places(estimate: Estimate) -> list[tuple[Cause, slice, slice]]:
    """Each cause with the places of its parameters in the vector and of its run parameters."""
    places = []
    first, first_run = estimate.cause_start, 0
    for cause in estimate.hypothesis.causes:
        end, end_run = first + len(cause.parameters), first_run + len(cause.run_parameters)
        places.append((cause, slice(first, end), slice(first_run, end_run)))
        first, first_run = end, end_run
    return places


def slopes_kept(kept: str | None, begun: NuisanceSlopes | None) -> NuisanceSlopes | None:
    """An estimate's own slopes: none, all with which its fit began, or only those by nuisances."""
    if kept == "nuisances" and begun is not None:
        return replace(begun, calibrated=None)
    return begun if kept else None


class FitCache:
    """Runs the steps of a diagnosis; a step that the journal holds is not run again."""

    def __init__(
        self,
        plant: GreyBox,
        journal: Journal | None = None,
        announce: Callable[[str], None] = lambda step: None,
        prefix: str = "",
    ):
        """Begin with the fits of a journal.

        Args:
            plant: the plant to whose causes the journal refers.
            journal: finished fits; None keeps nothing.
            announce: called with the name of every step before it begins.
            prefix: of the names of all steps.
        """
        self.plant = plant
        self.journal = journal
        self.announce = announce
        self.prefix = prefix

    def named(self, prefix: str) -> "FitCache":
        """The same cache for a second search: all names of its steps begin with the prefix, too."""
        return FitCache(self.plant, self.journal, self.announce, self.prefix + prefix)

    def __call__(
        self,
        step: str,
        fit: Callable[[], list[Estimate]],
        slopes: Callable[[Estimate], NuisanceSlopes | None] = lambda estimate: None,
    ) -> list[Estimate]:
        """The estimates that `fit` returns, or returned in an earlier run under this step's name.

        slopes: those with which the fit to an estimate began, which a journal does not keep.
        """
        step = self.prefix + step
        self.announce(step)
        if self.journal is not None and step in self.journal:

            def read(found: list[dict[str, Any]]) -> list[Estimate]:
                return [
                    replace(each, slopes=slopes_kept(entry["slopes"], slopes(each)))
                    for each, entry in ((self._estimate(entry), entry) for entry in found)
                ]

            return self.journal.read(step, read)
        estimates = fit()
        if self.journal is not None:
            entries = [
                {
                    "causes": list(estimate.hypothesis.labels),
                    "vector": estimate.vector.tolist(),
                    "local": estimate.run_values.tolist(),
                    "chi_square": estimate.chi_square,
                    "converged": estimate.converged,
                    "given_up": estimate.given_up,
                    "slopes": estimate.slopes and ("all" if estimate.slopes.calibrated else "nuisances"),
                    "laws": [
                        [o.cause.label, o.argument, o.low, o.high] for o in estimate.hypothesis.laws
                    ],
                }
                for estimate in estimates
            ]
            self.journal.add(step, entries)
        return estimates

    def _estimate(self, entry: dict[str, Any]) -> Estimate:
        """An estimate as the journal has it. Raises ValueError and others for what is none."""
        causes = {cause.label: cause for cause in self.plant.causes}
        hypothesis = Hypothesis(
            causes=tuple(causes[label] for label in entry["causes"]),
            laws=tuple(
                Law(cause=causes[label], argument=argument, low=low, high=high)
                for label, argument, low, high in entry["laws"]
            ),
        )
        count = len(self.plant.parameters) + len(hypothesis.parameters)
        if not entry["chi_square"] >= 0:
            raise ValueError("no sum of squares")
        return Estimate(
            hypothesis=hypothesis,
            vector=numbers(entry["vector"], count),
            run_values=numbers(entry["local"], len(self.plant.runs), len(hypothesis.run_parameters)),
            chi_square=entry["chi_square"],
            converged=entry["converged"],
            given_up=entry["given_up"],
        )


class FittingProblem:
    """Weighted readings of a plant, with the nuisance slopes that hold for all estimates."""

    def __init__(
        self,
        plant: GreyBox,
        slopes: NuisanceSlopes | None = None,
    ):
        """Weigh the readings of a plant.

        Args:
            plant: the model and its recordings.
            slopes: nuisance slopes of estimates that have none; None: nuisances have no effect.
        """
        self.plant = plant
        self.fitted_runs = [r for r, run in enumerate(plant.runs) if not run.held_out]
        self.all_runs = list(range(len(plant.runs)))
        self.readings = sum(int(np.sum(plant.runs[r].trusted)) for r in self.fitted_runs)
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

    def nominal_start(self) -> Estimate:
        """The nominal model; derivatives of the calibrated parameters are taken there."""
        start = self.start(Hypothesis(causes=()), {})
        return replace(start, slopes=replace(self.slopes, calibrated=None))

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
            nuisance.symbol: nuisance.centre + estimate.run_values[None, :, j]
            for j, nuisance in enumerate(estimate.hypothesis.run_parameters)
        }
        laws = {symbol: np.array([value]) for symbol, value in self.law_values(estimate).items()}
        return {**values, **run_values, **laws}

    def law_values(self, estimate: Estimate) -> dict[str, float]:
        """Values by symbol [SI] with which the plant simulates the laws of an estimate."""
        values: dict[str, float] = {}
        for number, (law, components) in enumerate(estimate.acting_laws, start=1):
            growth = law.growth(components)
            simulated = self.plant.law_values  # type: ignore[attr-defined]
            values |= simulated(number, law.cause, law.argument, law.low, law.high, growth)
        return values

    def candidates(self, estimates: Sequence[Estimate]) -> dict[str, NDArray]:
        """Values by symbol of n estimates side by side, (n,) or (n, runs) [SI], for `GreyBox`."""
        n = len(estimates)
        columns: dict[str, NDArray] = {}
        for i, estimate in enumerate(estimates):
            for p, scaled in zip(self.parameters(estimate), estimate.vector, strict=True):
                nominal = np.full(n, p.nominal, dtype=float)
                columns.setdefault(p.symbol, nominal)[i] = scaled * p.scale
            for symbol, value in self.law_values(estimate).items():
                columns.setdefault(symbol, np.zeros(n))[i] = value
            run_parameters = estimate.hypothesis.run_parameters
            for nuisance, own in zip(run_parameters, estimate.run_values.T, strict=True):
                centre = np.full((n, len(self.plant.runs)), nuisance.centre)
                columns.setdefault(nuisance.symbol, centre)[i] = nuisance.centre + own
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

    def priors(self, estimate: Estimate) -> tuple[NDArray, NDArray]:
        """Precision of the vector's Gaussian priors, and the vector less their means, (k,) each [1]."""
        parameters = self.parameters(estimate)
        precision = np.array([(p.scale / p.sd) ** 2 for p in parameters])
        return precision, estimate.vector - np.array([p.mean / p.scale for p in parameters])

    def slopes_of(self, estimate: Estimate) -> NuisanceSlopes:
        """Nuisance slopes that hold for an estimate."""
        return estimate.slopes or self.slopes

    def outputs(self, estimates: Sequence[Estimate], runs: Sequence[int]) -> list[NDArray]:
        """Weighted outputs of n estimates, per run (values, n) [noise deviations]."""
        outputs = self.plant.outputs(self.candidates(estimates), runs)
        weighted = [
            noise_weighted(self.plant, r, output).reshape(-1, len(estimates))
            for r, output in zip(runs, outputs, strict=True)
        ]
        # What is larger comes from an unstable simulation: it counts as failed.
        return [np.where(np.abs(y) < 1e9, y, np.nan) for y in weighted]

    def residuals(self, estimates: Sequence[Estimate], runs: Sequence[int]) -> list[NDArray]:
        """Weighted measured - model of n estimates, per run (values, n) [noise deviations]."""
        return [self.residual(r, y) for r, y in zip(runs, self.outputs(estimates, runs), strict=True)]

    def residual(self, run: int, outputs: NDArray) -> NDArray:
        """Measured less weighted outputs (values, n) of a run [noise deviations]."""
        # A candidate that cannot be simulated is far worse than every usable one: the fit moves away.
        return np.nan_to_num(self.measured[run][:, None] - outputs, nan=1e3)
