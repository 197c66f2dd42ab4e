"""State equations of the model and the states that a missing term may depend on."""

from dataclasses import dataclass

from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class StateEquation:
    """One state equation. The diagnosis adds a forcing where physics may be missing."""

    name: str
    state: str
    """State whose rate the equation gives, as named in `GreyBox.states`."""
    component: str
    unit: str
    """Unit of the forcing in reports."""
    scale: float = 1.0
    """Size of that unit in SI."""
    meaning: str = ""
    """The equation in words, as in 'balance of the air'; empty where the name says it."""
    step: float
    """Forcing for a finite difference [SI]; 0 for an identity such as x' = v, which lacks nothing."""

    @property
    def title(self) -> str:
        """The equation for people."""
        return f"{self.meaning} ({self.name})" if self.meaning else self.name


@dataclass(frozen=True, kw_only=True)
class StateTrace:
    """A state of the model, or a function of its states and inputs, over a run."""

    unit: str
    """Unit in reports."""
    scale: float
    """Size of that unit in SI."""
    values: NDArray
    """Time course, (samples,) [SI]."""
