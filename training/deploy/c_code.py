"""The C files of a policy's whole controller, and its contract as data.

Templates hold the coil's memory and the network; the check of the sensors, the learner, the advice and
the rules are translated from their Python source (controller_c.py)."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers import knowledge, network, pulse, sensor_check, valve_learner
from controllers.knowledge import INPUTS, RULES, SHIELDS
from controllers.policy import Policy
from controllers.policy_files import learnt_contract
from epv_env import observation
from epv_env.observation import ENTRIES, HISTORY, LONGEST_WAIT, P2_LAGS, P3_LAGS, contract
from training.deploy.controller_c import (
    PLANT,
    READINGS,
    REAL,
    ROW,
    SENSES,
    VALVE,
    ControllerC,
    listed,
    literal,
)

TEMPLATES = Path(__file__).parent / "templates"
TITLE = "Pressure limiting by an electro-pneumatic protection valve: a trained policy."
FORMAT = "epv-deployment/2"
CODE = ("epv_policy.h", "epv_policy.c", "epv_learner.h")
"""Files that hold the controller."""

LEAST_AGREEMENT = 0.9999
"""Share of the states on which the code must decide as Python: single precision may pass a threshold."""

RECORDS = {SENSES: sensor_check.SENSES, VALVE: valve_learner.VALVE}
"""What is remembered of a valve, by the name of the C structure."""


def _in_c(record: np.dtype) -> np.dtype:
    """A record as C lays it out, in single precision."""
    return np.dtype([(n, "f4", kind.shape) for n, (kind, *_) in (record.fields or {}).items()])


MEMORY = np.dtype(
    [*((name.removeprefix("epv_"), _in_c(record)) for name, record in RECORDS.items()),
     ("waited", "u2"), ("coil", "u1")],
    align=True,
)  # fmt: skip
"""The C structure of a valve's memory."""


@dataclass(frozen=True, kw_only=True)
class Export:
    """What the files are made of."""

    policy: Policy
    period: float
    """Control period [s]."""
    weights_sha256: str
    """Which weights these are."""
    provenance: Mapping[str, Any]
    """Where they come from."""

    @property
    def layers(self) -> list[tuple[NDArray, NDArray]]:
        """Weight (outputs, inputs) and bias (outputs,) of each layer."""
        return self.policy.network.layers

    @property
    def widest(self) -> int:
        """Signals of the widest hidden layer."""
        return max([1, *(len(bias) for _, bias in self.layers[:-1])])


def controller_c(export: Export) -> ControllerC:
    """C of all but the network's layers. Raises ExportError for what has no form in C."""
    parts = export.policy.constants
    table = parts.knowledge.table._asdict()
    constants = {
        "table": {name: values[0] if values.ndim > 1 else values for name, values in table.items()},
        "p": parts.knowledge.plan._asdict(),
        "ends": parts.ends._asdict(),
        "thresholds": parts.fallback._asdict(),
    }
    shapes = {4: table["gain"].shape[1:]}
    records = RECORDS | {READINGS: observation.READINGS}
    c = ControllerC(constants=constants, shapes=shapes, indices=("t",), records=records)
    c.texts.append(c.structure(READINGS))
    c.function(sensor_check.hold, (SENSES, READINGS, PLANT, REAL))
    c.function(sensor_check.remember, (SENSES,))
    c.function(sensor_check.show, (SENSES, READINGS, ROW))
    c.function(sensor_check.watch, (SENSES, READINGS, PLANT, REAL))
    c.function(sensor_check.overruled, (SENSES, REAL))
    c.function(valve_learner.observe, (VALVE, PLANT, PLANT, READINGS, REAL, REAL, REAL))
    c.function(pulse.plan, (VALVE, PLANT, PLANT, PLANT, REAL))
    c.function(knowledge.show_learnt, (VALVE, ROW))
    c.function(knowledge.forced, (VALVE, REAL))
    c.function(network.tangent, (REAL,))
    return c


def sources(export: Export) -> dict[str, str]:
    """The text of each file of CODE."""
    layers, c = export.layers, controller_c(export)
    fields: dict[str, Any] = {
        "title": TITLE,
        "source": f"Weights with SHA-256 {export.weights_sha256}.",
        "entries": ENTRIES,
        "inputs": INPUTS,
        "period_us": round(export.period * 1e6),
        "period": literal(export.period),
        "longest": literal(LONGEST_WAIT),
        "longest_wait": ceil(LONGEST_WAIT / export.period - 1e-9),
        "layers": len(layers),
        "widest": export.widest,
        "records": "\n".join(map(c.structure, RECORDS)),
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
    }
    texts = {name: filled(TEMPLATES / name, fields) for name in ("epv_policy.h", "epv_policy.c")}
    head = (
        "/* Check of the sensors, learner, advice and rules: translated from their Python source. */\n"
    )
    return texts | {"epv_learner.h": head + c.sources()}


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
    table = sum(values.size for values in controller_c(export).arrays.values())
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
        "of rules and shields those shields remain that keep the coil on",
        "timing": "read, decide and switch at each period's start; the coil stays so through it. Time "
        "counts in calls: called more often, waits end early and the learnt rates are wrong; jitter of "
        "a call shifts its readings. The stated agreement holds for the period alone",
        "operations": {
            "multiply_accumulates": sum(weights for weights, _ in sizes),
            "tanh": tangents,
            "members_of_the_learner": valve_learner.MEMBERS,
        },
        "bytes": {
            "constants": 4 * (sum(map(sum, sizes)) + table),
            "memory_of_a_valve": MEMORY.itemsize,
            "buffers_on_the_stack": 4 * (2 * export.widest + INPUTS + ENTRIES),
        },
    }
