"""The C files of a policy: the templates beside this file, filled with its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from string import Template

import numpy as np

from controllers.learned import LearnedPolicy
from epv_env.observation import HISTORY, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS
from training.deploy.quantise import FixedPolicy
from training.deploy.tables import fixed_tables, float_tables, listed, literal

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

SIGNALS = {"float": "float", "fixed": "int16_t"}
"""What the layers take in."""
CELLS = {
    "float": "    float cell[{}]; /* of the gated recurrent unit */\n",
    "fixed": "    int32_t cell[{}]; /* of the gated recurrent unit, 32767 * 32768 stands for 1 */\n",
}
"""The member of the memory that a policy without cells lacks: C99 has no array of none."""

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
        "cells": export.policy.cells,
        "longest_wait": ceil(LONGEST_WAIT / export.period - 1e-9),
    }
    filled = {}
    for variant, numbers in (
        ("float", _float_numbers(export.policy, export.period)),
        ("fixed", _fixed_numbers(export.fixed)),
    ):
        parts = _parts(variant, export.policy.cells, numbers)
        for suffix in ("h", "c"):
            name = f"epv_{variant}.{suffix}"
            filled[name] = _fill(name, common | numbers | parts)
    return filled


def _parts(variant: str, cells: int, numbers: dict[str, str]) -> dict[str, str]:
    """What the variants share, and what only a policy with cells has."""
    names = {"variant": variant, "capital": variant.upper(), "signal": SIGNALS[variant]}
    return {
        "remember": _fill("remember.c", names),
        "cell_member": CELLS[variant].format(cells) if cells else "",
        "see": _fill(f"cells_{variant}.c" if cells else "cells_none.c", names | numbers),
    }


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


def _float_numbers(policy: LearnedPolicy, period: float) -> dict[str, str]:
    return float_tables(policy) | {
        "centre": listed(np.array([quantity.centre for quantity in LAYOUT])),
        "scale": listed(np.array([quantity.scale for quantity in LAYOUT])),
        "limit": listed(np.array([quantity.limit for quantity in LAYOUT])),
        "period": literal(period),
        "longest": literal(LONGEST_WAIT),
        "values": _values(FLOAT_VALUES),
    }


def _fixed_numbers(fixed: FixedPolicy) -> dict[str, str]:
    return fixed_tables(fixed) | {
        "longest_us": str(round(LONGEST_WAIT * 1e6)),
        "centre": listed(fixed.inputs.centre),
        "reach": listed(fixed.inputs.reach),
        "factor": listed(fixed.inputs.factor),
        "factor_shift": str(fixed.inputs.shift),
        "tangent": listed(fixed.tangent),
        "values": _values(FIXED_VALUES),
    }


def _values(expressions: dict[str, str]) -> str:
    """Assignments to value[] in the order of the layout; a KeyError says that an entry is new."""
    known = expressions | CHANGES
    return "\n".join(f"    value[{i}] = {known[quantity.name]};" for i, quantity in enumerate(LAYOUT))
