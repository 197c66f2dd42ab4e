"""What a column may hold instead of what it should: another unit, reference, sign or channel."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import combinations, permutations, product

import numpy as np
from numpy.typing import NDArray

PRESSURES: tuple[str, ...] = ("p1", "p2", "p3")

GROUPS = (PRESSURES, *combinations(PRESSURES, 1), *combinations(PRESSURES, 2))
"""Channels that share a mistake: all from one device, one sensor, or two."""


@dataclass(frozen=True, kw_only=True)
class Scale:
    """One way to misread a channel: right value = factor × reading + offset."""

    text: str
    """What the column holds, to follow "looks like"."""
    remedy: str
    """What to do about it."""
    factor: float = 1.0
    """Right value over reading."""
    offset: float = 0.0
    """[unit of the channel]."""
    effort: float = 1.0
    """Mistakes that lead to it."""


@dataclass(frozen=True, kw_only=True)
class Misreading:
    """An explanation of contradictions: scales by channel, and channels that changed places."""

    scales: Mapping[str, Scale] = field(default_factory=dict)
    """By channel, after the exchange."""
    source: Mapping[str, str] = field(default_factory=dict)
    """Channel whose column holds a channel; empty: each its own."""
    effort: float
    """Number of mistakes that it assumes; the least is named."""

    def corrected(self, signals: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """The signals, each (samples,), as they would be without the mistakes."""
        right = {}
        for name in signals:
            values = signals[self.source.get(name, name)]
            scale = self.scales.get(name)
            right[name] = values if scale is None else scale.factor * values + scale.offset
        return right

    def sentence(self, columns: Mapping[str, str]) -> str:
        """What looks wrong, with its remedy; columns: names of the columns by channel."""
        findings = [*self._exchange(columns), *self._scale_sentences(columns)]
        return "; ".join(findings)

    def _exchange(self, columns: Mapping[str, str]) -> Iterator[str]:
        moved = {name: other for name, other in self.source.items() if name != other}
        if len(moved) == 2:
            first, second = (columns[name] for name in moved)
            yield f"{first} and {second} look swapped: exchange the two columns"
        elif moved:
            places = ", ".join(f"{columns[o]} holds {n}" for n, o in moved.items())
            names = " and ".join(columns[name] for name in moved)
            yield f"{names} look swapped ({places}): rename the columns"

    def _scale_sentences(self, columns: Mapping[str, str]) -> Iterator[str]:
        by_scale: dict[str, list[str]] = {}
        for name, scale in self.scales.items():
            by_scale.setdefault(scale.text, []).append(columns[self.source.get(name, name)])
        remedies = {scale.text: scale.remedy for scale in self.scales.values()}
        for text, names in by_scale.items():
            verb = "looks" if len(names) == 1 else "look"
            yield f"{' and '.join(names)} {verb} like {text}: {remedies[text]}"


def pressure_scales(ambient: float) -> tuple[Scale, ...]:
    """Ways to misread a pressure that should be in bar absolute; ambient [bar]."""
    units = {
        "Pa": (1e-5, "divide Pa by 100000"),
        "mbar": (1e-3, "divide mbar by 1000"),
        "kPa": (1e-2, "divide kPa by 100"),
        "MPa": (10.0, "multiply MPa by 10"),
        "psi": (0.0689475729, "multiply psi by 0.0689476"),
        "bar, 100 times too small": (100.0, "multiply by 100"),
        "bar, 1000 times too small": (1000.0, "multiply by 1000"),
    }
    add = "add the environment's pressure"
    scales = [
        Scale(text="bar, 10 times too large", factor=0.1, effort=1.4, remedy="divide by 10"),
        Scale(text="gauge pressure", offset=ambient, remedy=f"give bar absolute ({add})"),
        Scale(
            text="absolute pressure to which the ambient was added",
            offset=-ambient,
            remedy="give bar absolute (subtract the environment's pressure once)",
        ),
    ]
    for name, (factor, way) in units.items():
        scales += [
            Scale(text=name, factor=factor, remedy=f"give bar absolute ({way})"),
            Scale(
                text=f"{name}, gauge",
                factor=factor,
                offset=ambient,
                effort=1.1,
                remedy=f"give bar absolute ({way}, then {add})",
            ),
        ]
        if factor > 1.0:  # the reading is so small that an ambient pressure hides it
            scales += _hidden(name, factor, way, ambient)
    return tuple(scales)


def _hidden(name: str, factor: float, way: str, ambient: float) -> list[Scale]:
    """Small readings that were taken for gauge pressure, so that somebody added the ambient [bar]."""
    subtract, add = "subtract the environment's pressure", "add the environment's pressure"
    return [
        Scale(
            text=f"{name}, to which the ambient was added",
            factor=factor,
            offset=-factor * ambient,
            effort=1.2,
            remedy=f"give bar absolute ({subtract}, then {way})",
        ),
        Scale(
            text=f"{name}, gauge, to which the ambient was added",
            factor=factor,
            offset=ambient - factor * ambient,
            effort=1.3,
            remedy=f"give bar absolute ({subtract}, {way}, then {add})",
        ),
    ]


def pressure_misreadings(ambient: float, offsets: Mapping[str, float]) -> list[Misreading]:
    """Explanations of contradicting pressures, the ones of least effort first.

    ambient [bar]. offsets: what a channel would have to be corrected by to agree with the others [bar].
    """
    found = [
        Misreading(scales={name: _shift(offset, "bar", effort=1.2)}, effort=1.2)
        for name, offset in offsets.items()
    ]
    for order in permutations(PRESSURES):
        source: dict[str, str] = dict(zip(PRESSURES, order, strict=True))
        exchange = {0: 0.0, 2: 1.0, 3: 1.3}[sum(name != other for name, other in source.items())]
        if exchange:
            found.append(Misreading(source=source, effort=exchange))
        for scale, names in product(pressure_scales(ambient), GROUPS):
            effort = exchange + scale.effort + (0.3 if len(names) == 2 else 0.0)
            found.append(Misreading(scales=dict.fromkeys(names, scale), source=source, effort=effort))
    return sorted(found, key=lambda misreading: misreading.effort)


def electrical_misreadings(signals: Mapping[str, NDArray], rest: NDArray) -> list[Misreading]:
    """Explanations of contradicting U [V] and I [A], each (samples,), of least effort first.

    rest: whether the coil has been off for its decay time, boolean (samples,).
    """
    voltages = (
        Scale(text="mV", factor=1e-3, remedy="give V (divide by 1000)"),
        Scale(text="kV", factor=1e3, remedy="give V (multiply by 1000)"),
        _flipped("U"),
        *_constant(signals["U"], rest, "V"),
        Scale(
            text="inverted voltage, high while the coil is off",
            factor=-1.0,
            offset=float(np.max(signals["U"]) + np.min(signals["U"])),
            remedy="give the voltage at the coil",
        ),
    )
    currents = (
        Scale(text="mA", factor=1e-3, remedy="give A (divide by 1000)"),
        Scale(text="kA", factor=1e3, remedy="give A (multiply by 1000)"),
        Scale(text="µA", factor=1e-6, remedy="give A (divide by 1000000)"),
        *(_tenfold(factor) for factor in (0.01, 0.1, 10.0, 100.0)),
        _flipped("I"),
        Scale(text="mA with the sign flipped", factor=-1e-3, effort=1.5, remedy="divide by -1000"),
        *_constant(signals["I"], rest, "A"),
    )
    found = [Misreading(source={"U": "I", "I": "U"}, effort=1.0)]
    found += [Misreading(scales={"U": scale}, effort=scale.effort) for scale in voltages]
    found += [Misreading(scales={"I": scale}, effort=scale.effort) for scale in currents]
    found += [
        Misreading(scales={"U": first, "I": second}, effort=first.effort + second.effort)
        for first, second in product(voltages, currents)
    ]
    return sorted(found, key=lambda misreading: misreading.effort)


def _flipped(name: str) -> Scale:
    """A channel with the wrong sign."""
    quantity = {"U": "voltage", "I": "current"}[name]
    return Scale(text=f"a {quantity} with its sign flipped", factor=-1.0, remedy="multiply by -1")


def _tenfold(factor: float) -> Scale:
    size = f"{1 / factor:g} times too large" if factor < 1 else f"{factor:g} times too small"
    return Scale(text=f"A, {size}", factor=factor, effort=1.1, remedy=f"multiply by {factor:g}")


def _constant(values: NDArray, rest: NDArray, unit: str) -> tuple[Scale, ...]:
    """An offset that the coil at rest shows, values (samples,) [unit]."""
    if not np.any(rest):
        return ()
    return (_shift(-float(np.median(values[rest])), unit, effort=1.05),)


def _shift(correction: float, unit: str, *, effort: float) -> Scale:
    """A channel that reads too much or too little throughout [unit]."""
    return Scale(
        text=f"readings with an offset of {-correction:.3g} {unit}",
        offset=correction,
        effort=effort,
        remedy=f"have the sensor checked, or subtract {-correction:.3g} {unit}",
    )
