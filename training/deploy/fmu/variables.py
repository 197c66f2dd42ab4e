"""The variables of an FMU and the model behind them, as data for C and for modelDescription.xml."""

import math
from dataclasses import dataclass
from typing import Literal

Kind = Literal["input", "parameter", "output", "local", "time"]


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One variable; its value reference is its place in the model's list. SI units."""

    name: str
    """Name in the FMU: the symbol of docs/explanation/plant-model.md, or state.SYMBOL."""
    kind: Kind
    """What an importer may do with it; the independent variable is of the kind "time"."""
    unit: str
    """SI unit as the parameter table writes it; "1" for none."""
    meaning: str
    """What it is, in a line."""
    start: float = 0.0
    """Value at the start of an input or parameter [unit]."""
    low: float = -math.inf
    """Least value of an input or parameter [unit]."""
    high: float = math.inf
    """Greatest value of an input or parameter [unit]."""
    discrete: bool = False
    """Whether an output changes at instants only."""

    @property
    def settable(self) -> bool:
        """Whether an importer gives its value."""
        return self.kind in ("input", "parameter")

    @property
    def in_c(self) -> str:
        """Name of its value reference in C."""
        return f"V_{self.name.replace('.', '_')}"


@dataclass(frozen=True, kw_only=True)
class Model:
    """All that an FMU is made of but for the version of the standard."""

    name: str
    """Name of the model."""
    identifier: str
    """The same as a name in C and of the binary."""
    description: str
    """What it is, in a sentence."""
    variables: tuple[Variable, ...]
    """In the order of their value references."""
    sources: dict[str, str]
    """Text of the C files that stand behind the standard's functions, by name; `model.h` is included."""
    step: float
    """Communication step that fits the model [s]."""
    stop: float = 1.0
    """Length of a simulation that shows what the model does [s]."""

    def of_kind(self, *kinds: Kind) -> list[Variable]:
        """Its variables of these kinds, in order."""
        return [variable for variable in self.variables if variable.kind in kinds]
