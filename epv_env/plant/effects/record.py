"""What is known of an effect: form, sizes, ranges, source, constants of its compiled functions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.primitives import Value

COMPONENTS = (
    "solenoid", "armature", "control_chamber", "protection_valve", "flow", "output_chamber", "supply",
    "sensor", "timing",
)  # fmt: skip
"""Components of the valve in which an effect may lie."""


class EffectError(ValueError):
    """An effect's record is incomplete or contradicts itself."""


@dataclass(frozen=True, kw_only=True)
class Size:
    """A number that sizes an effect: a row of the parameter table. SI units."""

    symbol: str
    constant: str = ""
    """Name by which compiled functions read the size as it is; "": they read `Effect.constants`."""
    unit: str = ""
    domain: tuple[float, float] | None = None
    """Physical range; 0 is off. None: the report's own tables hold this row (parameters.json)."""
    meaning: str = ""
    trials: tuple[float, ...] = ()
    """Sizes from which a fit begins; (): the diagnosis does not fit this size."""
    least_fitted: float | None = None
    """Lower end of a fit's range where a smaller size is not felt, or is too stiff to simulate."""
    spread: float | None = None
    """Standard deviation of a size that says how the effect departs from its usual form at 0; None: the
    size says how strong the effect is."""
    drawn: tuple[float, float] | None = None
    """Range of sealed trials and sweeps, log-uniform; None: neither draws this size."""
    swept: tuple[float, float] | None = None
    """Range of sweeps where sealed trials draw none."""
    either_sign: bool = False
    """Whether the drawn size may be negative, too."""
    stronger_when_smaller: bool = False
    """Whether the effect grows as the size falls; then 0 is off, and the least drawn size is the top."""
    scatter: float | None = None
    """Standard deviation between recordings of one valve; None: the size is the same in all of them."""
    difference: float | None = None
    """Change for a finite difference, where `scatter` is given."""

    @property
    def typical(self) -> float:
        """The geometric middle of what trials and sweeps draw."""
        low, high = self.drawn or self.swept or (0.0, 0.0)
        return float(np.sqrt(low * high))

    @property
    def mild(self) -> tuple[float, float]:
        """The drawn sizes from the weakest to the typical, least first."""
        low, high = self.drawn or self.swept or (0.0, 0.0)
        return (self.typical, high) if self.stronger_when_smaller else (low, self.typical)

    def draw(self, rng: np.random.Generator, sizes: tuple[float, float]) -> float:
        """A size, log-uniform between two sizes; with either sign if it has two."""
        drawn = float(np.exp(rng.uniform(*np.log(sizes))))
        return -drawn if self.either_sign and rng.uniform() < 0.5 else drawn


@dataclass(frozen=True)
class Constant:
    """A number that the compiled functions read, folded once per valve."""

    name: str
    value: Callable[[Mapping[str, NDArray]], Value]
    """From the parameters by symbol, each of shape (n,) or (), to the constant of the same shape."""
    is_size: bool = True
    """Whether a value other than zero means that the effect acts."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect of the catalogue (names and components: the contract of gap.json)."""

    name: str
    component: str
    """One of COMPONENTS."""
    form: str
    """What is added to the nominal equations, in symbols of docs/explanation/plant-model.md."""
    source: str
    """Where form and range come from."""
    sizes: tuple[Size, ...]
    alternatives: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Symbols that act together, by the label of the variant; {}: one variant with all sizes."""
    constants: tuple[Constant, ...] = ()
    """What the compiled functions read beside the sizes with a `constant`."""
    strength: tuple[str, ...] = ()
    """Constants that a law multiplies (law.py); (): the effect has no law but its own."""
    fastest_rate: Callable[[Mapping[str, NDArray]], NDArray] | None = None
    """Fastest rate that the effect adds to the state [1/s], shape as its parameters; None: none."""

    def __post_init__(self) -> None:
        for fault in _faults(self):
            raise EffectError(f"effect {self.name!r}: {fault}")

    @property
    def rows(self) -> tuple[Constant, ...]:
        """Rows of the kernel's table; () for an effect that acts outside of the equations."""
        read = (Constant(s.constant, itemgetter(s.symbol)) for s in self.sizes if s.constant)
        return (*read, *self.constants)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of all sizes."""
        return tuple(size.symbol for size in self.sizes)

    @property
    def strengths(self) -> tuple[str, ...]:
        """Symbols of the sizes that say how strong the effect is; those of its form may be left out."""
        return tuple(size.symbol for size in self.sizes if size.spread is None)

    @property
    def variants(self) -> dict[str, tuple[Size, ...]]:
        """Sizes that act together, by the variant's label."""
        by_symbol = {size.symbol: size for size in self.sizes}
        alternatives = self.alternatives or {"": self.symbols}
        return {label: tuple(by_symbol[s] for s in symbols) for label, symbols in alternatives.items()}

    @property
    def fitted(self) -> dict[str, tuple[Size, ...]]:
        """The sizes that the diagnosis fits together, by variant."""
        chosen = {
            v: tuple(s for s in sizes if s.trials or s.spread) for v, sizes in self.variants.items()
        }
        return {variant: sizes for variant, sizes in chosen.items() if sizes}

    @property
    def drawn(self) -> tuple[tuple[Size, ...], ...]:
        """The sizes that a sealed trial draws together, by variant."""
        strengths = (tuple(s for s in v if s.spread is None) for v in self.variants.values())
        return tuple(sizes for sizes in strengths if all(s.drawn for s in sizes))


def _faults(effect: Effect) -> list[str]:
    """What is missing or wrong in a record, each with its remedy."""
    texts = {"name": effect.name, "form": effect.form, "source": effect.source}
    faults = [f"{name} is empty: say it in a line" for name, text in texts.items() if not text]
    if effect.component not in COMPONENTS:
        faults.append(f"unknown component {effect.component!r}: choose one of {', '.join(COMPONENTS)}")
    if not effect.sizes:
        faults.append("it has no size: give at least one")
    unknown = {s for symbols in effect.alternatives.values() for s in symbols} - set(effect.symbols)
    if unknown:
        faults.append(f"alternatives name {', '.join(sorted(unknown))}: give a Size for each")
    strange = set(effect.strength) - {row.name for row in effect.rows}
    if strange:
        faults.append(f"strength names {', '.join(sorted(strange))}: name constants of the effect")
    for size in effect.sizes:
        if size.domain and not (size.unit and size.meaning):
            faults.append(f"{size.symbol} lacks its unit or its meaning: give both")
        if size.domain and not size.domain[0] <= 0.0 <= size.domain[1]:
            faults.append(f"0 lies outside the domain of {size.symbol}: 0 has to switch the effect off")
        if (size.scatter is None) != (size.difference is None):
            faults.append(f"{size.symbol} needs both scatter and difference, or neither")
    if not faults and not effect.fitted:
        faults.append("no size has trials: give sizes from which a fit begins")
    if not faults and not effect.drawn:
        faults.append("no variant has drawn ranges: give `drawn` to the sizes of one variant")
    return faults


SHORTEST_TIME = 1e-4
"""Time constant below which nothing is felt of a lag or of heat in a chamber, and neither acts [s]."""


def rate(time: NDArray) -> NDArray:
    """1/time [1/s], or 0 where the time [s] is too short to be felt; shape (n,) or ()."""
    return np.where(time < SHORTEST_TIME, 0.0, 1 / np.maximum(time, SHORTEST_TIME))
