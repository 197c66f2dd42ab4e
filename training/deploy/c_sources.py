"""The C files of a policy: the templates beside this file, filled with its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from string import Template

import numpy as np

from controllers.learned import LearnedPolicy
from epv_env.observation import HISTORY, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS
from training.deploy.c_arrays import fixed_tables, float_tables, listed, literal
from training.deploy.c_variants import FIXED, FLOAT, VARIANTS, Variant
from training.deploy.quantisation import FixedPolicy
from training.deploy.settings import SETTINGS, ExportSettings

TEMPLATES = Path(__file__).parent / "templates"
TITLE = "Pressure limiting by an electro-pneumatic protection valve: a trained policy."

READINGS = {
    "target": "now->target",
    "p1": "now->p1",
    "p3": "now->p3",
    "I": "now->current",
    "since_switching": "since",
}
"""Entries of the observation in C that both variants write alike, each in its unit."""

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
    numbers = {FLOAT: _float_numbers(export.policy, export.period), FIXED: _fixed_numbers(export.fixed)}
    common = _common(export)
    filled = {}
    for variant in VARIANTS:
        values = common | variant.template_fields(export.policy.cells) | numbers[variant]
        values |= _functions(variant, export.policy.cells, values)
        for suffix in ("h", "c"):
            filled[f"epv_{variant.name}.{suffix}"] = _fill(f"epv_policy.{suffix}", values)
    return filled


def _common(export: Export) -> dict[str, object]:
    """What both variants state alike."""
    return {
        "title": TITLE,
        "source": f"Weights with SHA-256 {export.weights_sha256}.",
        "inputs": len(LAYOUT),
        "history": HISTORY,
        "period_us": round(export.period * 1e6),
        "layers": len(export.policy.layers),
        "widest": export.widest,
        "cells": export.policy.cells,
        "longest_wait": ceil(LONGEST_WAIT / export.period - 1e-9),
    }


def _functions(variant: Variant, cells: int, values: Mapping[str, object]) -> dict[str, str]:
    """The variant's own functions: its arithmetic and, if the policy has cells, theirs."""
    functions = {"arithmetic": _fill(f"arithmetic_{variant.name}.c", values), "values": _values(variant)}
    if cells == 0:
        forgets = "(void)m; /* this policy remembers nothing but readings */"
        return functions | {"cell_functions": "", "next_cells": forgets}
    arithmetic = {"cell_arithmetic": _fill(f"cells_{variant.name}.c", values)}
    return functions | {
        "cell_functions": _fill("cells.c", {**values, **arithmetic}),
        "next_cells": f"next_cells(m, observation, seen + EPV_{variant.name.upper()}_INPUTS);",
    }


def checks(states: int, *, rounding: float, settings: ExportSettings = SETTINGS) -> dict[str, str]:
    """The text of the programs that test and time the code on so many states, by file name.

    rounding: how far the float code's logits lie from exact ones here [1]; settings.margin_factor times
    it is allowed.
    """
    allowed = settings.margin_factor * max(rounding, settings.least_rounding)
    numbers = {
        "states": states,
        "observation_tolerance": f"{settings.observation_tolerance:g}",
        "margin_tolerance": f"{allowed:g}",
    }
    return {name: _fill(name, numbers) for name in ("states.h", "parity.c", "bench.c")}


def _fill(name: str, values: Mapping[str, object]) -> str:
    """A template with its fields filled in. Raises KeyError for a field without a value."""
    return Template((TEMPLATES / name).read_text(encoding="utf-8")).substitute(values)


def _float_numbers(policy: LearnedPolicy, period: float) -> dict[str, str]:
    """Constants of the float variant. period: control period [s]."""
    return float_tables(policy) | {
        "centre": listed(np.array([quantity.centre for quantity in LAYOUT])),
        "scale": listed(np.array([quantity.scale for quantity in LAYOUT])),
        "limit": listed(np.array([quantity.limit for quantity in LAYOUT])),
        "period": literal(period),
        "longest": literal(LONGEST_WAIT),
    }


def _fixed_numbers(fixed: FixedPolicy) -> dict[str, str]:
    """Constants of the integer variant."""
    return fixed_tables(fixed) | {
        "longest_us": str(round(LONGEST_WAIT * 1e6)),
        "centre": listed(fixed.inputs.centre),
        "reach": listed(fixed.inputs.reach),
        "factor": listed(fixed.inputs.factor),
        "factor_shift": str(fixed.inputs.shift),
        "tangent": listed(fixed.tangent),
    }


def _values(variant: Variant) -> str:
    """Assignments to value[] in the order of the layout; a KeyError says that an entry is new."""
    known = {"p2_error": variant.p2_error, "action": variant.action} | READINGS | CHANGES
    return "\n".join(f"    value[{i}] = {known[quantity.name]};" for i, quantity in enumerate(LAYOUT))
