"""Numbers of the model that are not known exactly: fitted parameters and nuisance parameters."""

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
    scale: float = 1.0
    """Usual size [SI]; the optimiser works with value/scale."""


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
