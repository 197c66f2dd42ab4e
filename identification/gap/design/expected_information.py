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
from identification.gap.design.parameter_posterior import ParameterPosterior, parameter_posteriors
from identification.gap.design.rivals import Rivals
from identification.gap.design.settings import DesignSettings
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.linearisation import linearise, nuisance_slopes
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.model.grey_box import GreyBox
from identification.gap.model.recorded_run import Run
from identification.gap.rank.misfit import cause_effects
from identification.gap.rank.settings import RankingSettings


def expected_information(
    problem: FittingProblem,
    plan: GreyBox,
    rivals: Rivals,
    settings: DesignSettings | None = None,
    ranking: RankingSettings | None = None,
) -> list[InformationGain]:
    """Expected information of each run of a plan; none where a rival cannot simulate the run.

    Args:
        problem: of the campaign, whose fitted runs give the rivals' posteriors.
        plan: the campaign's plant with the experiments as its runs; their readings are not used.
        rivals: hypotheses between which the experiment is to decide.
        settings: judgement of the design; None: the defaults.
        ranking: errors of form; None: the defaults.
    """
    settings, ranking = settings or DesignSettings(), ranking or RankingSettings()
    posteriors = parameter_posteriors(problem, rivals.estimates)
    planned, estimates = _planned_problem(problem, plan, rivals.estimates)
    predictions = linearise(planned, estimates, planned.all_runs)
    gains = []
    for r, run in enumerate(plan.runs):
        own = [runs[r] for runs in predictions]
        if any(np.any(line.residual == planned.settings.failed_residual) for line in own):
            means, covariances = np.zeros((len(own), 1)), np.ones((len(own), 1, 1))
        else:
            means, covariances = _distributions(estimates, own, posteriors, run, settings, ranking)
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


def _distributions(
    estimates: Sequence[Estimate],
    runs: Sequence[LinearisedRun],
    posteriors: Sequence[ParameterPosterior],
    run: Run,
    settings: DesignSettings,
    ranking: RankingSettings,
) -> tuple[NDArray, NDArray]:
    """Means (rivals, d) and covariances (rivals, d, d) of one run's outcome [1]."""
    effects = np.column_stack(
        [cause_effects(estimate, own) for estimate, own in zip(estimates, runs, strict=True)]
    )
    channels, period = run.measured.shape[0], float(run.time[1])
    return outcome_distributions(runs, posteriors, effects, channels, period, settings, ranking)
