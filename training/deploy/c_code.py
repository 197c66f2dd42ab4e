"""The C files of a policy and its contract, as data: templates filled with its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from string import Template
from textwrap import fill
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.learned import LearnedPolicy
from epv_env.observation import HISTORY, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS, contract

TEMPLATES = Path(__file__).parent / "templates"
TITLE = "Pressure limiting by an electro-pneumatic protection valve: a trained policy."
FORMAT = "epv-deployment/2"

OBSERVATION_TOLERANCE = 2e-5
"""How far the C code's observation may lie from Python's [1], which is made of readings in double
precision: single precision's 5e-7 bar at 8 bar, over the least scale, 0.1 bar, and rounded several
times."""
MARGIN_FACTOR = 8.0
"""How many times the rounding of the logits measured here is allowed elsewhere [1]: another compiler may
contract or reorder sums, so that it rounds otherwise, but not much worse."""
LEAST_ROUNDING = 1e-6
"""Rounding of the logits that is allowed at least, before the factor [1]."""

MEMORY = np.dtype(
    [("p2", "f4", HISTORY), ("p3", "f4", HISTORY), ("waited", "u2"), ("newest", "u1"), ("coil", "u1"),
     ("begun", "u1")],
    align=True,
)  # fmt: skip
"""The C structure of a valve's memory."""

VALUES = {
    "p2_error": "now->p2 - now->target",
    "target": "now->target",
    "p1": "now->p1",
    "p3": "now->p3",
    "I": "now->current",
    "action": "(float)now->coil",
    "since_switching": "since",
} | {
    f"{name}_change_{lag}": f"change(m->{name}, m->newest, {lag})"
    for name, lags in (("p2", P2_LAGS), ("p3", P3_LAGS))
    for lag in lags
}
"""Entries of the observation in C, each in its unit."""


class ExportError(ValueError):
    """A policy cannot be exported: the message says why and what to do."""


@dataclass(frozen=True, kw_only=True)
class Export:
    """What the files are made of."""

    policy: LearnedPolicy
    period: float
    """Control period [s]."""
    weights_sha256: str
    """Which weights these are."""
    provenance: Mapping[str, Any]
    """Where they come from."""

    @property
    def widest(self) -> int:
        """Signals of the widest hidden layer."""
        return max([1, *(len(bias) for _, bias in self.policy.layers[:-1])])


def sources(export: Export) -> dict[str, str]:
    """The text of epv_policy.h and epv_policy.c. A KeyError says that an entry of the layout is new."""
    layers = export.policy.layers
    values = "\n".join(f"    value[{i}] = {VALUES[entry.name]};" for i, entry in enumerate(LAYOUT))
    fields: dict[str, Any] = {
        "title": TITLE,
        "source": f"Weights with SHA-256 {export.weights_sha256}.",
        "inputs": len(LAYOUT),
        "history": HISTORY,
        "period_us": round(export.period * 1e6),
        "period": literal(export.period),
        "longest": literal(LONGEST_WAIT),
        "longest_wait": ceil(LONGEST_WAIT / export.period - 1e-9),
        "layers": len(layers),
        "widest": export.widest,
        "values": values,
        "arrays": "\n".join(
            _array(f"const float {name}_{k}[{each.size}]", each)
            for k, layer in enumerate(layers)
            for name, each in zip(("WEIGHT", "BIAS"), layer, strict=True)
        ),
        "network": "".join(
            f"    {{WEIGHT_{k}, BIAS_{k}, {weight.shape[1]}, {weight.shape[0]}}},\n"
            for k, (weight, _) in enumerate(layers)
        ),
    }
    for name in ("centre", "scale", "limit"):
        fields[name] = listed(np.array([getattr(entry, name) for entry in LAYOUT]))
    return {name: filled(TEMPLATES / name, fields) for name in ("epv_policy.h", "epv_policy.c")}


def checks(states: int, rounding: float) -> dict[str, str]:
    """The text of the programs that test and time the code on so many states, by file name.

    rounding: how far the code's logits lie from exact ones here [1]; MARGIN_FACTOR times it is allowed.
    """
    allowed = MARGIN_FACTOR * max(rounding, LEAST_ROUNDING)
    fields = {
        "states": states,
        "observation_tolerance": f"{OBSERVATION_TOLERANCE:g}",
        "margin_tolerance": f"{allowed:g}",
    }
    return {name: filled(TEMPLATES / name, fields) for name in ("states.h", "parity.c", "bench.c")}


def filled(template: Path, fields: Mapping[str, Any]) -> str:
    """A template with its fields filled in. Raises KeyError for a field without a value."""
    return Template(template.read_text(encoding="utf-8")).substitute(fields)


def listed(values: NDArray) -> str:
    """Numbers of an array of any shape, row after row, as C writes them, on indented lines."""
    text = ", ".join(literal(value) for value in values.ravel())
    return f"\n{fill(text, 100, initial_indent='    ', subsequent_indent='    ')}\n"


def literal(value: float) -> str:
    """A float in C; nine digits give it back to the bit."""
    text = f"{value:.9g}"
    return f"{text}f" if any(mark in text for mark in ".e") else f"{text}.0f"


def _array(declaration: str, values: NDArray) -> str:
    """The definition of a constant array; values of any shape, row after row."""
    return f"static {declaration} = {{{listed(values.astype(np.float32))}}};\n"


def deployment_contract(export: Export) -> dict[str, Any]:
    """What an integrator has to know, as data: order, units and scaling of the observation, period,
    actions, and what the code needs."""
    sizes = [(weight.size, bias.size) for weight, bias in export.policy.layers]
    tangents = sum(bias for _, bias in sizes[:-1])
    return {
        "format": FORMAT,
        "policy": {"weights_sha256": export.weights_sha256, "provenance": export.provenance},
        "observation": contract(export.period),
        "readings": {"pressure": "bar absolute", "current": "A"},
        "memory": {
            "p2_lags_periods": P2_LAGS,
            "p3_lags_periods": P3_LAGS,
            "history_readings": HISTORY,
            "start": "zeros; the first readings stand for the past; the last switching was long ago",
            "since_switching": f"time since the last switching, at most {LONGEST_WAIT} s",
            "action": "what the coil did in the period that has just ended, whoever decided it",
        },
        "actions": {"0": "coil off: the protection valve opens", "1": "coil on: it shuts"},
        "decision": "0 if the logit of off is at least the logit of on, else 1",
        "timing": "read, decide and switch at each period's start; the coil stays so through it",
        "onnx": {
            "input": "observation: (batch, entries) float32",
            "outputs": {"logits": "(batch, 2) float32: off, on", "action": "(batch,) int64"},
        },
        "operations": {
            "multiply_accumulates": sum(weights for weights, _ in sizes),
            "tanh": tangents,
            "divisions": tangents + len(LAYOUT),
        },
        "bytes": {
            "constants": 4 * (sum(map(sum, sizes)) + 3 * len(LAYOUT)),
            "memory_of_a_valve": MEMORY.itemsize,
            "buffers_on_the_stack": 4 * (2 * export.widest + 2 * len(LAYOUT)),
        },
    }
