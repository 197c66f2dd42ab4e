"""Causes: the ways in which the nominal model may be wrong."""

from dataclasses import dataclass

from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One way in which the nominal model may be wrong."""

    name: str
    """Name as in the catalogue; all variants of a cause share the name."""
    component: str
    """Component of the plant in which the cause lies."""
    parameters: tuple[FreeParameter, ...]
    """Parameters that are fitted when the cause acts; at their nominal values it does not act."""
    run_parameters: tuple[NuisanceParameter, ...] = ()
    """Nuisance parameters of the cause that take a separate value in every run."""
    prior: float = 1.0
    """Probability before any data, relative to the other causes."""
    variant: str = ""
    """Which of several forms of the cause this is; empty where there is one form."""
    words: str = ""
    """What people read instead of a name that they cannot know; empty where the name says it."""
    exact_form: bool = False
    """True where the form is not in doubt: a parameter of the model differs from its nominal value."""

    @property
    def label(self) -> str:
        """Name and variant, as in files."""
        return f"{self.name} ({self.variant})" if self.variant else self.name

    @property
    def title(self) -> str:
        """The cause for people."""
        return self.words or self.label
