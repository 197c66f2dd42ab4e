"""Numbers of the model that are not known exactly: fitted parameters and nuisance parameters."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class FreeParameter:
    """A number that a fit may change: a calibrated parameter, or a parameter of a cause."""

    symbol: str
    unit: str
    low: float
    """One end of the physical range [SI]."""
    high: float
    """The other end of the physical range [SI]."""
    nominal: float = 0.0
    """Value in the nominal model [SI]."""
    trials: tuple[float, ...] = ()
    """Values [SI] from which the search for a cause begins; () for a calibrated parameter, whose search
    begins at `nominal`."""
    meaning: str = ""
    """What the parameter is, in words; empty where the symbol says it."""
    scale: float = math.nan
    """Usual size [SI], not 0; the optimiser works with value/scale. Left out: `usual_size`."""

    def __post_init__(self):
        """Give a parameter without a scale its usual size, so that every scale is a number."""
        if math.isnan(self.scale):
            object.__setattr__(self, "scale", self.usual_size)

    @property
    def title(self) -> str:
        """The parameter for people."""
        return f"{self.meaning} ({self.symbol})" if self.meaning else self.symbol

    @property
    def usual_size(self) -> float:
        """Magnitude of the nominal value; else of the first trial; else a tenth of the range [SI].

        Never 0: the optimiser divides by it.
        """
        first_trial = abs(self.trials[0] - self.nominal) if self.trials else 0.0
        return abs(self.nominal) or first_trial or abs(self.high - self.low) / 10 or 1.0


@dataclass(frozen=True, kw_only=True)
class NuisanceParameter:
    """A number with a Gaussian prior that is neither calibrated nor part of a gap."""

    symbol: str
    sd: float
    """Standard deviation about `centre` [SI]."""
    centre: float = 0.0
    """Expected value [SI]."""
    step: float
    """Change for a finite difference [SI]."""
