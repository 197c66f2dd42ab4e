"""What a calibration is about: recordings, the parameters that may move, and the plant that is fitted.

What a recording does not tell of itself exactly - its circuit pressure at the start, the zero of the p3
and I sensors on that day - is a nuisance, which the fits solve for at every candidate.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.free_parameters import FREE_PARAMETERS, Freedom, check_free
from epv_env.plant.parameters import Parameters, table
from identification.gap.fit.evidence import EvaluatedHypothesis, evaluate
from identification.gap.fit.fitting_problem import FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import nuisance_slopes
from identification.gap.plant import FreeParameter
from identification.quality.assessment import SensorOffset, assess_recording, sensor_offsets
from identification.recordings.noise import campaign_noise, campaign_steps
from identification.recordings.recording import Campaign, CampaignError, Recording
from identification.replay.model_inputs import without_offsets
from identification.replay.valve import ReplayedValve


@dataclass(frozen=True)
class ParameterVector:
    """Fitted symbols in order; an optimiser sees each divided by its reference value."""

    symbols: tuple[str, ...]
    reference: Parameters
    """Scales of the symbols, and the values of all parameters that are not fitted."""
    freedoms: Mapping[str, Freedom] = field(default_factory=dict)
    """Bounds and prior knowledge by symbol; a symbol without has its domain, and nothing is known."""

    @property
    def scale(self) -> NDArray:
        """Reference values [SI], (k,)."""
        return np.array([self.reference[symbol] for symbol in self.symbols])

    @property
    def domains(self) -> NDArray:
        """Least and greatest values: given bounds, else the ends of the domains [SI], (k, 2)."""
        return np.array([self._freedom(s).bounds or self.reference.domain(s) for s in self.symbols])

    @property
    def bounds(self) -> NDArray:
        """Scaled ends of the domains, the lesser first, (k, 2), without unit."""
        return np.sort(self.domains / self.scale[:, None], axis=1)

    def _freedom(self, symbol: str) -> Freedom:
        return self.freedoms.get(symbol, Freedom())

    def known(self) -> dict[str, tuple[float | None, float | None]]:
        """Mean and standard deviation of what is known before, by symbol [SI], ready for JSON."""
        freedoms = {symbol: self._freedom(symbol) for symbol in self.symbols}
        return {s: (f.mean, f.sd) for s, f in freedoms.items() if f.mean is not None}

    def free_parameters(self) -> list[FreeParameter]:
        """The symbols as the fits know them: from the reference, within the bounds."""
        return [
            FreeParameter(
                symbol=symbol,
                unit=table()[symbol].unit,
                low=low,
                high=high,
                nominal=self.reference[symbol],
                meaning=table()[symbol].meaning,
                scale=self.reference[symbol],
                mean=math.nan if known.mean is None else known.mean,
                sd=known.sd or math.inf,
            )
            for symbol, (low, high) in zip(self.symbols, self.domains.tolist(), strict=True)
            for known in [self._freedom(symbol)]
        ]

    def named(self, z: NDArray) -> dict[str, float]:
        """Values by symbol [SI] for one scaled vector (k,), within the domains."""
        inside = np.clip(z * self.scale, *self.domains.T)
        return dict(zip(self.symbols, inside.tolist(), strict=True))

    def parameters(self, z: NDArray) -> Parameters:
        """The complete set [SI] for one scaled vector (k,), within the domains."""
        return self.reference.replace(**self.named(z))

    def scaled(self, parameters: Mapping[str, float]) -> NDArray:
        """The scaled vector (k,), without unit, of a set of parameters [SI]."""
        return np.array([parameters[symbol] for symbol in self.symbols]) / self.scale


@dataclass(frozen=True, kw_only=True)
class CalibrationProblem:
    """Recordings free of their sensors' offsets, and a vector of parameters to fit to them."""

    calibration: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    noise: Mapping[str, float]
    """Standard deviation of each channel's noise [SI units]."""
    offsets: Mapping[str, SensorOffset]
    """What was subtracted from each channel; empty without a record at rest."""
    steps: Mapping[str, float]
    """Coarse steps of the readings by channel [SI]; empty on a bench whose noise moves every reading."""
    vector: ParameterVector
    """Its reference is where the calibration starts."""

    @cached_property
    def plant(self) -> ReplayedValve:
        """The calibration recordings and the model, as the fits know them."""
        return ReplayedValve(
            self.calibration,
            self.vector.reference,
            self.vector.free_parameters(),
            self.noise,
            self.steps.get("p2", 0.0),
        )

    def fitting(self, z: NDArray) -> FittingProblem:
        """The least-squares problem with the nuisances' derivatives at a scaled vector (k,)."""
        rough = FittingProblem(self.plant)
        start = rough.start(Hypothesis(causes=()), self.vector.named(z))
        return FittingProblem(self.plant, *nuisance_slopes(rough, [start], [np.zeros(0)]))

    def evaluated(self, z: NDArray) -> EvaluatedHypothesis:
        """A scaled vector (k,) with its residuals and its covariance."""
        fitting = self.fitting(z)
        start = fitting.start(Hypothesis(causes=()), self.vector.named(z))
        return evaluate(fitting, [start])[0]


def calibration_problem(
    campaign: Campaign,
    *,
    start: Parameters | None = None,
    free: Mapping[str, Freedom] = FREE_PARAMETERS,
) -> CalibrationProblem:
    """The problem that a campaign poses, from `start` (None: Table 10) at the campaign's ambient.

    free: which parameters may move, and how far.

    Raises CampaignError if there is no recording to fit to; ParameterError for parameters that
    cannot be fitted, or ambient conditions outside the plant's domain.
    """
    if not campaign.with_role("calibration"):
        raise CampaignError(
            f"campaign {campaign.name!r} has no recording with role 'calibration': give at least one"
        )
    start = (start or Parameters.initial_guess()).replace(
        T_env=campaign.temperature, p_env=campaign.pressure
    )
    check_free(free, start)
    steps = campaign_steps(campaign.recordings, campaign.rules)
    offsets = _offsets(campaign, steps)
    values = {name: offset.value for name, offset in offsets.items()}
    return CalibrationProblem(
        calibration=tuple(without_offsets(r, values) for r in campaign.with_role("calibration")),
        validation=tuple(without_offsets(r, values) for r in campaign.with_role("validation")),
        noise=campaign_noise(campaign),
        offsets=offsets,
        steps=steps,
        vector=ParameterVector(symbols=tuple(free), reference=start, freedoms=free),
    )


def _offsets(campaign: Campaign, steps: Mapping[str, float]) -> dict[str, SensorOffset]:
    """The sensors' offsets from the first quality recording that shows them."""
    for recording in campaign.with_role("quality"):
        assessed = assess_recording(
            recording, campaign.pressure, steps=steps, sensors=campaign.rules.sensors
        )
        offsets = sensor_offsets(assessed)
        if offsets:
            return offsets
    return {}
