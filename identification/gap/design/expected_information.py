"""Which experiment next: the one with the highest expected information about the rival hypotheses.

A planned experiment is a run in which nothing has been measured yet (Bayesian experimental design:
Chaloner and Verdinelli 1995). Each rival predicts a Gaussian around its best fit. Noise, the open part
of the rival's parameters, and the run's own offsets give its width. So a difference that recalibration
within the posterior absorbs tells no rivals apart. Nor does a difference within the error of the forms,
which all rivals share: the experiment does not ask whether a form errs.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.design.information_gain import InformationGain, information_gain
from identification.gap.design.outcome_distribution import outcome_distributions
from identification.gap.design.parameter_posterior import parameter_posteriors
from identification.gap.design.rivals import Rivals
from identification.gap.design.settings import DesignSettings
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate, cause_places, nominal_vector
from identification.gap.fit.linearisation import linearise, nuisance_slopes
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.model.grey_box import GreyBox


def expected_information(
    problem: FittingProblem,
    plan: GreyBox,
    rivals: Rivals,
    settings: DesignSettings | None = None,
) -> list[InformationGain]:
    """Expected information of each run of a plan; none where a rival cannot simulate the run.

    Args:
        problem: of the campaign, whose fitted runs give the rivals' posteriors.
        plan: the campaign's plant with the experiments as its runs; their readings are not used.
        rivals: hypotheses between which the experiment is to decide.
        settings: judgement of the design; None: the defaults.
    """
    settings = settings or DesignSettings()
    posteriors = parameter_posteriors(problem, rivals.estimates)
    planned, estimates = _planned_problem(problem, plan, rivals.estimates)
    predictions = linearise(planned, estimates, planned.all_runs)
    effects = _simulated_effects(planned, estimates, predictions)
    gains = []
    for r, run in enumerate(plan.runs):
        own = [runs[r] for runs in predictions]
        if any(np.any(line.residual == planned.settings.failed_residual) for line in own):
            means, covariances = np.zeros((len(own), 1)), np.ones((len(own), 1, 1))
        else:
            channels, period = run.measured.shape[0], float(run.time[1])
            means, covariances = outcome_distributions(
                own, posteriors, effects[r], channels, period, settings
            )
        gains.append(information_gain(means, covariances, rivals.probability, settings.outcomes))
    return gains


def _planned_problem(
    problem: FittingProblem, plan: GreyBox, estimates: Sequence[Estimate]
) -> tuple[FittingProblem, list[Estimate]]:
    """The plan with nuisance slopes at the first rival, and the rivals in the plan's runs."""
    planned = [_planned(estimate, plan) for estimate in estimates]
    rough = FittingProblem(plan, settings=problem.settings)
    slopes = nuisance_slopes(rough, planned[:1], [np.zeros(len(plan.tolerances))])[0]
    return FittingProblem(plan, slopes, problem.settings), planned


def _planned(estimate: Estimate, plan: GreyBox) -> Estimate:
    """The estimate in the plan's runs, whose run parameters have their expected values."""
    centres = [nuisance.centre for nuisance in estimate.hypothesis.run_parameters]
    return replace(estimate, run_values=np.tile(np.array(centres), (len(plan.runs), 1)), slopes=None)


def _simulated_effects(
    planned: FittingProblem,
    estimates: Sequence[Estimate],
    predictions: Sequence[Sequence[LinearisedRun]],
) -> list[NDArray]:
    """Effects of all rivals' causes of uncertain form, per run (values, causes) [noise deviations].

    Each effect is the difference between simulations with and without the cause. A
    linear effect holds near the campaign; a planned run may drive the plant beyond it.
    """
    without, rivals = [], []
    for index, estimate in enumerate(estimates):
        for cause, place, _ in cause_places(estimate):
            if not cause.exact_form:
                vector = estimate.vector.copy()
                vector[place] = nominal_vector(cause)
                without.append(replace(estimate, vector=vector))
                rivals.append(index)
    if not without:
        return [np.zeros((len(measured), 0)) for measured in planned.measured]
    return [
        residuals - np.stack([predictions[index][r].residual for index in rivals], axis=1)
        for r, residuals in enumerate(planned.residuals(without, planned.all_runs))
    ]
