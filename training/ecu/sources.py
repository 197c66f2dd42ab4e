"""The C files of a policy: the templates beside this file, filled with its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from string import Template
from textwrap import fill

import numpy as np
from numpy.typing import NDArray

from controllers.learned import LearnedPolicy
from epv_env.observation import HISTORY, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS
from training.ecu.quantise import FixedPolicy

TEMPLATES = Path(__file__).parent / "templates"
TITLE = "Pressure limiting by an electro-pneumatic protection valve: a trained policy."
OBSERVATION_TOLERANCE = 2e-5
"""How far the C code's observation may lie from Python's, which is made of readings in double precision:
single precision's 5e-7 bar at 8 bar, over the least scale, 0.1 bar, and rounded several times."""

MARGIN_ROOM = 8
"""Another compiler may contract or reorder sums, so that it rounds otherwise, but not much worse."""

FLOAT_VALUES = {
    "p2_error": "now->p2 - now->target",
    "target": "now->target",
    "p1": "now->p1",
    "p3": "now->p3",
    "I": "now->current",
    "action": "(float)now->coil",
    "since_switching": "since",
}
"""Each entry of the observation in C, in its unit, but for the changes."""

FIXED_VALUES = FLOAT_VALUES | {
    "p2_error": "(int64_t)now->p2 - now->target",
    "action": "now->coil ? 1000 : 0",
}
"""The same in the units of epv_fixed."""

CHANGES = {
    f"{name}_change_{lag}": f"change(m->{name}, m->newest, {lag})"
    for name, lags in (("p2", P2_LAGS), ("p3", P3_LAGS))
    for lag in lags
}


@dataclass(frozen=True, kw_only=True)
class Export:
    """What the files are made of."""

    policy: LearnedPolicy
    fixed: FixedPolicy
    period: float
    """Control period [s]."""
    weights_sha256: str
    """Which weights these are."""

    @property
    def widest(self) -> int:
        """Signals of the widest hidden layer."""
        return max([1, *(len(bias) for _, bias in self.policy.layers[:-1])])


def sources(export: Export) -> dict[str, str]:
    """The text of each C file of the policy by its name."""
    common = {
        "title": TITLE,
        "source": f"Weights with SHA-256 {export.weights_sha256}.",
        "inputs": len(LAYOUT),
        "history": HISTORY,
        "period_us": round(export.period * 1e6),
        "layers": len(export.policy.layers),
        "widest": export.widest,
        "longest_wait": ceil(LONGEST_WAIT / export.period - 1e-9),
    }
    filled = {}
    for variant, numbers in (("float", _float_numbers(export)), ("fixed", _fixed_numbers(export.fixed))):
        remember = _fill("remember.c", {"variant": variant, "capital": variant.upper()})
        for suffix in ("h", "c"):
            name = f"epv_{variant}.{suffix}"
            filled[name] = _fill(name, common | numbers | {"remember": remember})
    return filled


def checks(states: int, *, rounding: float) -> dict[str, str]:
    """The text of the programs that test and time the code on so many states, by file name.

    rounding: how far the float code's logits lie from exact ones here; MARGIN_ROOM times it is allowed.
    """
    numbers = {
        "states": states,
        "observation_tolerance": f"{OBSERVATION_TOLERANCE:g}",
        "margin_tolerance": f"{MARGIN_ROOM * max(rounding, 1e-6):g}",
    }
    return {name: _fill(name, numbers) for name in ("states.h", "parity.c", "bench.c")}


def _fill(name: str, values: Mapping[str, object]) -> str:
    return Template((TEMPLATES / name).read_text(encoding="utf-8")).substitute(values)


def _float_numbers(export: Export) -> dict[str, str]:
    arrays, rows = [], []
    for k, (weight, bias) in enumerate(export.policy.layers):
        arrays.append(_array(f"const float WEIGHT_{k}[{weight.size}]", weight.astype(np.float32)))
        arrays.append(_array(f"const float BIAS_{k}[{bias.size}]", bias.astype(np.float32)))
        rows.append(f"    {{WEIGHT_{k}, BIAS_{k}, {weight.shape[1]}, {weight.shape[0]}}},\n")
    return {
        "centre": _listed(np.array([quantity.centre for quantity in LAYOUT])),
        "scale": _listed(np.array([quantity.scale for quantity in LAYOUT])),
        "limit": _listed(np.array([quantity.limit for quantity in LAYOUT])),
        "period": _literal(export.period),
        "longest": _literal(LONGEST_WAIT),
        "arrays": "\n".join(arrays),
        "network": "".join(rows),
        "values": _values(FLOAT_VALUES),
    }


def _fixed_numbers(fixed: FixedPolicy) -> dict[str, str]:
    arrays, rows = [], []
    for k, layer in enumerate(fixed.layers):
        outputs, inputs = layer.weight.shape
        arrays.append(_array(f"const int8_t WEIGHT_{k}[{layer.weight.size}]", layer.weight))
        arrays.append(_array(f"const uint32_t FACTOR_{k}[{outputs}]", layer.factor))
        arrays.append(_array(f"const int32_t BIAS_{k}[{outputs}]", layer.bias))
        rows.append(f"    {{WEIGHT_{k}, FACTOR_{k}, BIAS_{k}, {inputs}, {outputs}, {layer.shift}}},\n")
    return {
        "longest_us": str(round(LONGEST_WAIT * 1e6)),
        "centre": _listed(fixed.inputs.centre),
        "reach": _listed(fixed.inputs.reach),
        "factor": _listed(fixed.inputs.factor),
        "factor_shift": str(fixed.inputs.shift),
        "arrays": "\n".join(arrays),
        "network": "".join(rows),
        "tangent": _listed(fixed.tangent),
        "values": _values(FIXED_VALUES),
    }


def _values(expressions: dict[str, str]) -> str:
    """Assignments to value[] in the order of the layout; a KeyError says that an entry is new."""
    known = expressions | CHANGES
    return "\n".join(f"    value[{i}] = {known[quantity.name]};" for i, quantity in enumerate(LAYOUT))


def _array(declaration: str, values: NDArray) -> str:
    return f"static {declaration} = {{{_listed(values)}}};\n"


def _listed(values: NDArray) -> str:
    """Numbers as C writes them, on indented lines of their own."""
    text = ", ".join(_literal(value) for value in values.ravel())
    return f"\n{fill(text, 100, initial_indent='    ', subsequent_indent='    ')}\n"


def _literal(value: float | np.generic) -> str:
    """A number in C; nine digits give a float back to the bit."""
    if isinstance(value, (float, np.floating)):
        text = f"{value:.9g}"
        return f"{text}f" if any(mark in text for mark in ".e") else f"{text}.0f"
    return f"{value}u" if isinstance(value, np.unsignedinteger) else str(value)
