"""Types of the values that people give to constructors, checked in words."""

import math
import reprlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from numbers import Real
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

WORDS: dict[Any, str] = {
    float: "a number",
    str: "a text",
    Callable: "a function",
    tuple: "two numbers, (low, high)",
    Mapping: "a mapping of values by symbol",
    UnionType: "two arrays of numbers, or None",
}
"""What to give, by the kind of a field's type."""


def shown(value: Any) -> str:
    """A value as one short line of a message."""
    try:
        return " ".join(reprlib.repr(value).split())
    except ValueError:  # a whole number of thousands of digits
        return f"a {type(value).__name__} too long to print"


def real(value: Any) -> float:
    """A real number as a float, infinite beyond its range. Raises TypeError."""
    value = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real):
        raise TypeError
    try:
        return float(value)
    except OverflowError:
        return math.inf


def numbers(values: Any, *shape: int) -> NDArray:
    """Decoded JSON as an array. Raises ValueError unless it is of finite numbers in this shape."""
    found = np.array(values)
    if found.shape != shape or found.dtype.kind not in "bif" or not np.all(np.isfinite(found)):
        raise ValueError(f"not {shape} finite numbers")
    return found


def check_fields(instance: Any, error: type[ValueError] = ValueError) -> None:
    """Raises `error` unless each field of a dataclass's instance has a value of the field's type."""
    for name, hint in _hints(type(instance)).items():
        check_type(f"{type(instance).__name__}: {name}", getattr(instance, name), hint, error)


def check_type(name: str, value: Any, hint: Any, error: type[ValueError], give: str = "") -> None:
    """Raises `error` unless a value is of the type `hint`.

    name: begins the sentence. give: what to give instead, where WORDS do not say it.
    """
    if not _is(value, hint):
        raise error(f"{name} is {shown(value)}: give {give or WORDS[get_origin(hint) or hint]}")


@cache
def _hints(dataclass: type) -> dict[str, Any]:
    hints = get_type_hints(dataclass)
    return {entry.name: hints[entry.name] for entry in fields(dataclass)}


def _is(value: Any, hint: Any) -> bool:
    """Whether a value is of a type: a class, a number, a tuple, a function, or one of several."""
    kind = get_origin(hint) or hint
    if isinstance(hint, UnionType):
        return any(_is(value, each) for each in get_args(hint))
    if kind is tuple:
        parts, ends = get_args(hint), isinstance(value, (tuple, list, np.ndarray))
        return ends and np.shape(value)[:1] == (len(parts),) and all(map(_is, value, parts))
    if hint is float:
        return _is_real(value)
    return callable(value) if kind is Callable else isinstance(value, kind)


def _is_real(value: Any) -> bool:
    try:
        real(value)
    except TypeError:
        return False
    return True
