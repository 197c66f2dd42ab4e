"""Settings of the joint fits."""

from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """Judgement in the damped Gauss-Newton fits and in predictions from them."""

    difference_step: float = 1e-3
    """Relative change of a scaled parameter for a finite difference [1]: large against rounding of the
    simulation, small against the curvature of the outputs."""

    smallest_differenced_value: float = 0.1
    """Scaled parameter [1] below which the difference step no longer shrinks with the parameter: a cause
    near its nominal value needs a step that the outputs show."""

    failed_residual: float = 1e3
    """Residual of a reading whose candidate cannot be simulated [noise deviations]: far above every
    residual of a usable candidate, so that the fit moves away."""

    iterations: int = 12
    """Most Gauss-Newton iterations, for computing time. A fit that needs more is weighed as it is and
    reported as not converged."""

    initial_damping: float = 1e-3
    """Levenberg-Marquardt damping of the first step, relative to the diagonal [1]: nearly none, as
    starts are expected to be close."""

    damping_decrease: float = 0.2
    """Factor on the damping after a step that decreased chi-square [1] (Marquardt 1963)."""

    damping_increase: float = 10.0
    """Factor on the damping after a step that did not decrease chi-square [1] (Marquardt 1963)."""

    least_damping: float = 1e-9
    """Lower bound of the damping, relative to the diagonal [1]: practically none."""

    most_damping: float = 1e6
    """Upper bound of the damping, relative to the diagonal [1]. A fit ends at a tenth of the bound,
    where a step is too short to gain anything."""

    converged_decrease: float = 0.3
    """Predicted decrease of chi-square [1] below which a fit has converged: less changes no odds."""

    converged_excess_share: float = 3e-3
    """Predicted decrease below which a fit has converged, as a share of the excess, chi-square beyond
    one per reading [1]: a cause that leaves a large residual need not be fitted to the last digit."""

    thorough_iterations: int = 40
    """The number of iterations for plants with a small catalogue, whose fits cost little."""

    thorough_excess_share: float = 1e-4
    """The converged share of the excess for such plants [1]: a flat valley is followed to its end."""

    promised_decreases: float = 3.0
    """Multiple of the predicted decrease [1] that a fit may still gain, before it is given up: steps of
    a nonlinear model gain more than they predict at first."""

    hopeless_excess_ratio: float = 3.0
    """A fit is given up if its excess stays above this multiple of its best rival's excess [1], for
    computing time."""

    hopeless_excess_per_reading: float = 0.05
    """Excess per reading that the rule above adds [1]: noise is not known to the percent."""

    largest_deviation: float = 3.0
    """Bound of a nuisance parameter [standard deviations from its centre]: a larger deviation is not a
    nuisance and stays in the residual."""

    prediction_iterations: int = 3
    """Gauss-Newton steps for a cause's run parameters when a run is predicted; the outputs are nearly
    linear in them, so that three suffice."""

    @property
    def thorough(self) -> "FitSettings":
        """The settings for plants with a small catalogue."""
        return replace(
            self,
            iterations=self.thorough_iterations,
            converged_excess_share=self.thorough_excess_share,
        )
