"""The C files of a policy's whole controller, and its contract as data.

Templates hold the readings' memory, the network and the check of p3; the learner, the advice and the
rules are translated from their Python source (controller_c.py)."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers import held_readings, knowledge, p3_check, pulse, valve_learner
from controllers.hysteresis import Hysteresis
from controllers.knowledge import RULES, SHIELDS
from controllers.p3_check import P3Check
from controllers.policy import Policy
from controllers.policy_files import learnt_contract
from controllers.valve_learner import LEARNT
from epv_env.observation import HISTORY, INDEX, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS, contract
from training.deploy.controller_c import (
    ARRAY,
    PLANT,
    REAL,
    VALVE,
    ControllerC,
    listed,
    literal,
)
from training.deploy.translation import ExportError

TEMPLATES = Path(__file__).parent / "templates"
TITLE = "Pressure limiting by an electro-pneumatic protection valve: a trained policy."
FORMAT = "epv-deployment/2"
CODE = ("epv_policy.h", "epv_policy.c", "epv_learner.h")
"""Files that hold the controller."""
INPUTS = len(LAYOUT) + len(LEARNT)
"""Inputs of the network: readings and learnt quantities."""

LEAST_AGREEMENT = 0.9999
"""Share of the states on which the code must decide as Python: single precision may pass a threshold."""

_VALVE_C = np.dtype(
    [(name, "f4", kind.shape) for name, (kind, *_) in (valve_learner.VALVE.fields or {}).items()],
    align=True,
)
MEMORY = np.dtype(
    [("p2", "f4", HISTORY), ("p3", "f4", HISTORY), ("last", "f4", len(held_readings.CHANNELS)),
     ("waited", "u2"), ("newest", "u1"), ("coil", "u1"), ("begun", "u1"), ("lost", "u1"),
     ("fallback", "u1"), ("failed", "u1"), ("periods", "u2"), ("valve", _VALVE_C)],
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


@dataclass(frozen=True, kw_only=True)
class Export:
    """What the files are made of."""

    controller: P3Check
    """The whole: a `Policy`, and a `Hysteresis` that takes over where sensors fail."""
    period: float
    """Control period [s]."""
    weights_sha256: str
    """Which weights these are."""
    provenance: Mapping[str, Any]
    """Where they come from."""

    @property
    def policy(self) -> Policy:
        """The network behind the rules. Raises ExportError for another controller."""
        if not isinstance(self.controller.main, Policy):
            raise ExportError(
                f"{self.controller.name!r} is no policy: give a folder that training wrote"
            )
        return self.controller.main

    @property
    def layers(self) -> list[tuple[NDArray, NDArray]]:
        """Weight (outputs, inputs) and bias (outputs,) of each layer."""
        return self.policy.network.layers

    @property
    def widest(self) -> int:
        """Signals of the widest hidden layer."""
        return max([1, *(len(bias) for _, bias in self.layers[:-1])])


def learner_c(export: Export) -> ControllerC:
    """C of the learner, the advice and the rules. Raises ExportError for what has no form in C."""
    table = export.policy.knowledge.learner.table._asdict()
    constants = {
        "table": {name: values[0] if values.ndim > 1 else values for name, values in table.items()},
        "p": pulse.PLAN._asdict(),
    }
    shapes = {4: table["gain"].shape[1:]}
    c = ControllerC(constants=constants, shapes=shapes, indices=("t",), record=valve_learner.VALVE)
    c.function(valve_learner.begin, (VALVE,))
    c.function(valve_learner.observe, (VALVE, PLANT, PLANT, ARRAY, REAL, REAL, REAL))
    c.function(pulse.plan, (VALVE, PLANT, PLANT, PLANT, REAL))
    c.function(knowledge.shown, (REAL, REAL))
    c.function(knowledge.cannot_raise, (VALVE,))
    c.function(knowledge.would_rise_too_far, (VALVE,))
    c.function(knowledge.compiled_above_band, (REAL,))
    c.function(knowledge.below_band, (VALVE, REAL))
    return c


def sources(export: Export) -> dict[str, str]:
    """The text of each file of CODE. A KeyError says that an entry of the layout is new."""
    layers, learner = export.layers, learner_c(export)
    values = "\n".join(f"    value[{i}] = {VALUES[entry.name]};" for i, entry in enumerate(LAYOUT))
    learnt = "\n".join(
        f"    inputs[{len(LAYOUT) + k}] = fn_shown(m->valve.{entry.name}, {k});"
        for k, entry in enumerate(LEARNT)
    )
    fields: dict[str, Any] = {
        "title": TITLE,
        "source": f"Weights with SHA-256 {export.weights_sha256}.",
        "readings": len(LAYOUT),
        "inputs": INPUTS,
        "history": HISTORY,
        "period_us": round(export.period * 1e6),
        "period": literal(export.period),
        "longest": literal(LONGEST_WAIT),
        "longest_wait": ceil(LONGEST_WAIT / export.period - 1e-9),
        "layers": len(layers),
        "widest": export.widest,
        "values": values,
        "learnt": learnt,
        "valve": learner.valve(),
        "advice": listed(export.policy.network.advice_weight),
        "filter_time": literal(valve_learner.FILTER_TIME),
        "arrays": "\n".join(
            _array(f"const float {name}_{k}[{each.size}]", each)
            for k, layer in enumerate(layers)
            for name, each in zip(("WEIGHT", "BIAS"), layer, strict=True)
        ),
        "network": "".join(
            f"    {{WEIGHT_{k}, BIAS_{k}, {weight.shape[1]}, {weight.shape[0]}}},\n"
            for k, (weight, _) in enumerate(layers)
        ),
        "held": held_readings.HELD,
        **_p3_check_fields(export),
    }
    ends = (*held_readings.limits(export.controller.sensors), held_readings.START)
    fields |= {n: listed(v) for n, v in zip(("least", "greatest", "start"), ends, strict=True)}
    for name in ("centre", "scale", "limit"):
        fields[name] = listed(np.array([getattr(entry, name) for entry in LAYOUT]))
    texts = {name: filled(TEMPLATES / name, fields) for name in ("epv_policy.h", "epv_policy.c")}
    head = "/* What is learnt of a valve, advice and rules: translated from their Python source. */\n"
    return texts | {"epv_learner.h": head + learner.sources()}


def _p3_check_fields(export: Export) -> dict[str, Any]:
    """Numbers of the check of p3 and of the controller behind it. Raises ExportError."""
    behind = export.controller.fallback
    if not isinstance(behind, Hysteresis):
        raise ExportError(f"{behind.name!r} behind the check of p3 is no hysteresis: extend c_code.py")
    names = {
        "p1": "p1", "p3": "p3", "p3_change": p3_check.CHANGE, "since": "since_switching",
        "p2_error": "p2_error", "p2_change": f"p2_change_{behind.lag}",
    }  # fmt: skip
    numbers = {
        "ambient": p3_check.AMBIENT,
        "still": p3_check.STILL,
        "margin": p3_check.MARGIN,
        "wait": min(p3_check.WAIT, LONGEST_WAIT) - export.period / 2,
        "slope_time": behind.lag * export.period,
        "open_below": behind.open_below,
        "shut_above": behind.shut_above,
        "open_lookahead": behind.open_lookahead,
        "shut_lookahead": behind.shut_lookahead,
    }
    return {name: INDEX[entry] for name, entry in names.items()} | {
        name: literal(number) for name, number in numbers.items()
    }


def filled(template: Path, fields: Mapping[str, Any]) -> str:
    """A template with its fields filled in. Raises KeyError for a field without a value."""
    return Template(template.read_text(encoding="utf-8")).substitute(fields)


def _array(declaration: str, values: NDArray) -> str:
    """The definition of a constant array; values of any shape, row after row."""
    return f"static {declaration} = {{{listed(values.astype(np.float32))}}};\n"


def deployment_contract(export: Export) -> dict[str, Any]:
    """What an integrator has to know, as data: order, units and scaling of the observation, period,
    actions, and what the code needs."""
    sizes = [(weight.size, bias.size) for weight, bias in export.layers]
    tangents = sum(bias for _, bias in sizes[:-1])
    table = sum(values.size for values in learner_c(export).arrays.values())
    return {
        "format": FORMAT,
        "policy": {"weights_sha256": export.weights_sha256, "provenance": export.provenance},
        "observation": contract(export.period),
        "learnt": learnt_contract(),
        "rules": [*RULES, *SHIELDS],
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
        "decision": "1 if a rule says so; else 0 if the logit of off is at least that of on, else 1; "
        "where p3 is implausible or readings are lost, a hysteresis that does not read p3 decides, and "
        "of the rules the shield above the band remains",
        "timing": "read, decide and switch at each period's start; the coil stays so through it",
        "operations": {
            "multiply_accumulates": sum(weights for weights, _ in sizes),
            "tanh": tangents,
            "members_of_the_learner": valve_learner.MEMBERS,
        },
        "bytes": {
            "constants": 4 * (sum(map(sum, sizes)) + 3 * len(LAYOUT) + table),
            "memory_of_a_valve": MEMORY.itemsize,
            "buffers_on_the_stack": 4 * (2 * export.widest + INPUTS + len(LAYOUT)),
        },
    }
