"""What the calibration searches with, and from when on it warns (section 6.2)."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class CalibrationSettings:
    """Judgements of the calibration stage."""

    starts: int = 6
    """Searches of each method: one from Table 10, the others spread over the domains."""
    precision: float = 1e-6
    """Relative change of the parameters at which a search has converged."""
    most_evaluations: int = 2000
    """Evaluations of the total error; a Nelder-Mead search that needs more has not converged."""
    most_steps: int = 200
    """Steps of a least-squares search; a search that needs more has not converged."""
    same_minimum: float = 1e-3
    """Relative difference of the parameters within which two searches reach the same minimum."""
    near_bound: float = 1e-3
    """Share of a domain within which an estimate counts as on the domain's end."""
    ill_conditioned: float = 30.0
    """Condition number of the normalised sensitivities from which collinearity is strong (Belsley
    1980)."""
    involved_weight: float = 0.3
    """Weight of a parameter in the flattest direction from which the warning names the parameter."""
    unexplained: float = 1.2
    """Root mean square residual, in noise deviations, from which the model misses the recordings."""
    accepted_error: float = 0.1
    """Total error that the report accepts (sections 6.1 and 7), a fraction."""

    def changed(self) -> dict[str, Any]:
        """Fields that differ from the defaults, apart from `starts`; they mark a journal of searches."""
        usual = asdict(CalibrationSettings())
        return {
            name: value
            for name, value in asdict(self).items()
            if name != "starts" and value != usual[name]
        }


CALIBRATION = CalibrationSettings()
"""The default settings."""
