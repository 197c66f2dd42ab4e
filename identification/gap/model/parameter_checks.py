"""Checks of parameters, causes, nuisance parameters and equations: numbers that a search can use."""

from collections.abc import Iterator
from itertools import combinations
from math import isfinite

from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter
from identification.gap.model.grey_box import GreyBox
from identification.gap.model.names import repeated


def parameter_findings(plant: GreyBox) -> Iterator[str]:
    """Sentences on what is wrong with the parameters, causes, nuisances and equations of a plant."""
    if not plant.parameters and not plant.causes:
        yield "parameters, causes: both are empty, so nothing can be fitted: give one parameter or cause"
    for parameter in plant.parameters:
        yield from _calibrated_findings(parameter)
    for cause in plant.causes:
        yield from _cause_findings(cause)
    for member, nuisances in (("tolerances", plant.tolerances), ("run_offsets", plant.run_offsets)):
        for nuisance in nuisances:
            yield from _nuisance_findings(member, nuisance)
    yield from _symbol_findings(plant)
    for equation in plant.equations:
        if not (isfinite(equation.step) and equation.step >= 0):
            yield (
                f"equations, {equation.name}: step {equation.step:g} is negative: give a positive "
                "forcing, or "
                "0 for an equation that lacks nothing"
            )


def _calibrated_findings(parameter: FreeParameter) -> Iterator[str]:
    member = f"parameters, {parameter.symbol}"
    yield from _range_findings(member, parameter)
    if not parameter.low <= parameter.nominal <= parameter.high:
        yield (
            f"{member}: nominal {parameter.nominal:g} lies outside {parameter.low:g} to "
            f"{parameter.high:g}, "
            "but the search begins there: widen the range or correct the value"
        )


def _range_findings(member: str, parameter: FreeParameter) -> Iterator[str]:
    low, high, scale = parameter.low, parameter.high, parameter.scale
    if not (isfinite(low) and isfinite(high) and low < high):
        yield f"{member}: low {low:g} and high {high:g} are no range: give two numbers, low below high"
    if not (isfinite(scale) and scale > 0):
        yield (
            f"{member}: scale {scale:g} is not positive, but the search divides by it: leave it out, or "
            "give "
            "a usual size"
        )


def _cause_findings(cause: Cause) -> Iterator[str]:
    member = f"causes, {cause.label}"
    if not cause.parameters:
        yield f"{member}: it has no parameters, so nothing can be fitted: give it a size"
    for symbol in repeated(p.symbol for p in (*cause.parameters, *cause.run_parameters)):
        yield f"{member}: two of its parameters are named {symbol}: rename one"
    if not (isfinite(cause.prior) and cause.prior > 0):
        yield f"{member}: prior {cause.prior:g} is not positive: give 1, or leave the cause out"
    for parameter in cause.parameters:
        place = f"{member}, {parameter.symbol}"
        yield from _range_findings(place, parameter)
        if not parameter.trials:
            yield f"{place}: it has no trials, but the search begins there: give one value or more"
        for trial in parameter.trials:
            yield from _trial_findings(place, parameter, trial)
    for nuisance in cause.run_parameters:
        yield from _nuisance_findings(member, nuisance)


def _trial_findings(place: str, parameter: FreeParameter, trial: float) -> Iterator[str]:
    if trial == parameter.nominal:
        yield (
            f"{place}: trial {trial:g} is the nominal value, where the cause does not act: give another "
            "one"
        )
    elif not parameter.low <= trial <= parameter.high:
        yield (
            f"{place}: trial {trial:g} lies outside {parameter.low:g} to {parameter.high:g}: give one "
            "inside, "
            "or widen the range"
        )


def _nuisance_findings(member: str, nuisance: NuisanceParameter) -> Iterator[str]:
    for name, value in (("sd", nuisance.sd), ("step", nuisance.step)):
        if not (isfinite(value) and value > 0):
            yield (
                f"{member}, {nuisance.symbol}: {name} {value:g} is not positive: give a positive one, "
                "or leave it out"
            )


def _symbol_findings(plant: GreyBox) -> Iterator[str]:
    """Symbols with two meanings; a cause may shift a tolerance, variants of a cause share symbols."""
    calibrated = [p.symbol for p in plant.parameters]
    offsets = [n.symbol for n in plant.run_offsets]
    for member, symbols in (
        ("parameters", calibrated),
        ("tolerances", [n.symbol for n in plant.tolerances]),
        ("run_offsets", offsets),
        ("causes", [cause.label for cause in plant.causes]),
    ):
        for symbol in repeated(symbols):
            yield f"{member}: two are named {symbol}: rename one"
    for symbol in sorted({*calibrated, *offsets} & {n.symbol for n in plant.tolerances}):
        yield f"tolerances, {symbol}: it is a parameter or a run offset as well: strike one of them"
    for symbol in sorted(set(calibrated) & set(offsets)):
        yield f"run_offsets, {symbol}: it is a calibrated parameter as well: strike one of them"
    for cause in plant.causes:
        for symbol in sorted(_symbols(cause) & {*calibrated, *offsets}):
            yield (
                f"causes, {cause.label}: {symbol} is a calibrated parameter or a run offset as well: "
                "give "
                "the cause a symbol of its own"
            )
    for one, other in combinations(plant.causes, 2):
        for symbol in sorted(_symbols(one) & _symbols(other) if one.name != other.name else ()):
            yield (
                f"causes, {one.label} and {other.label}: both have {symbol}: give each its own symbol, "
                "or "
                "make them variants of one name"
            )


def _symbols(cause: Cause) -> set[str]:
    return {parameter.symbol for parameter in (*cause.parameters, *cause.run_parameters)}
