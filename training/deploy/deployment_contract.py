"""The contract of an export, as data: what an integrator of the exported policy has to know."""

from typing import Any

from epv_env.observation import HISTORY, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS, contract
from training.deploy.c_arrays import named_fixed_layers, named_layers
from training.deploy.c_sources import Export
from training.deploy.compiled_export import memory_type
from training.deploy.quantisation import GATE_ONE, SIGNAL_ONE, SUM_ONE, UNITS

FORMAT = "epv-deployment/1"


def deployment_contract(export: Export, *, provenance: dict[str, Any]) -> dict[str, Any]:
    """Order, units and scaling of the observation, period, actions, and each variant's cost."""
    return {
        "format": FORMAT,
        "policy": {"weights_sha256": export.weights_sha256, "provenance": provenance},
        "observation": contract(export.period),
        "memory": {
            "p2_lags_periods": P2_LAGS,
            "p3_lags_periods": P3_LAGS,
            "history_readings": HISTORY,
            "start": "the first readings stand for the past; the last switching was long ago",
            "since_switching": f"time since the last switching, at most {LONGEST_WAIT} s",
            "action": "what the coil did in the period that has just ended, whoever decided it",
            "cells": export.policy.cells,
            "cells_start": "zeros; each decision takes the gated recurrent unit's cells one period on",
        },
        "actions": {"0": "coil off: the protection valve opens", "1": "coil on: it shuts"},
        "decision": "0 if the logit of off is at least the logit of on, else 1",
        "timing": "read, decide and switch at each period's start; the coil stays so through it",
        "variants": {
            "onnx": _onnx(export),
            "float": _float(export),
            "fixed": _fixed(export),
        },
    }


def _onnx(export: Export) -> dict[str, Any]:
    """Inputs and outputs of the ONNX model."""
    content = {
        "files": ["policy.onnx"],
        "input": "observation: (batch, entries) float32",
        "outputs": {"logits": "(batch, 2) float32: off, on", "action": "(batch,) int64"},
        "memory": "none",
    }
    if export.policy.cells:
        cells = f"(batch, {export.policy.cells}) float32"
        content["outputs"] |= {"next_memory": cells}
        content["memory"] = f"input memory: {cells}, zeros at the start, then the last next_memory"
    return content


def _float(export: Export) -> dict[str, Any]:
    """Units, operations and bytes of the float variant."""
    weights = sum(weight.size + bias.size for weight, bias in named_layers(export.policy).values())
    return {
        "files": ["epv_float.h", "epv_float.c"],
        "readings": {"pressure": "bar absolute", "current": "A"},
        "memory": "epv_float_memory: zeros at the start, then what the last period left",
        "operations": _operations(export) | {"divisions": _tangents(export) + len(LAYOUT)},
        "bytes": {
            "constants": 4 * (weights + 3 * len(LAYOUT)),
            "memory_of_a_valve": memory_type("float", export.policy.cells).itemsize,
            "buffers_on_the_stack": 4 * (2 * export.widest + 3 * len(LAYOUT) + export.policy.cells),
        },
    }


def _fixed(export: Export) -> dict[str, Any]:
    """Units, scaling, operations and bytes of the integer variant."""
    layers, inputs = named_fixed_layers(export.fixed).values(), export.fixed.inputs
    cells = export.policy.cells
    rows = sum(len(layer.bias) for layer in layers)
    constants = sum(layer.weight.nbytes + layer.factor.nbytes + layer.bias.nbytes for layer in layers)
    return {
        "files": ["epv_fixed.h", "epv_fixed.c"],
        "readings": {"pressure": "Pa absolute", "current": "uA"},
        "memory": "epv_fixed_memory: zeros at the start, then what the last period left",
        "arithmetic": "weights int8, a scale for each row; observation, activations int16; sums int32",
        "one": {"activations": SIGNAL_ONE, "logits": SUM_ONE}
        | ({"cells": SIGNAL_ONE * GATE_ONE} if cells else {}),
        "observation": [
            {"name": q.name, "unit": UNITS[q.unit][0], "centre": int(centre), "reach": int(reach)}
            for q, centre, reach in zip(LAYOUT, inputs.centre, inputs.reach, strict=True)
        ],
        "operations": _operations(export)
        | {"scalings_by_32x32_bits": rows + 4 * cells + len(LAYOUT), "divisions": 0},
        "bytes": {
            "constants": constants + export.fixed.tangent.nbytes + 12 * len(LAYOUT),
            "memory_of_a_valve": memory_type("fixed", cells).itemsize,
            "buffers_on_the_stack": 4 * (export.widest + len(LAYOUT) + cells) + 8 * len(LAYOUT),
        },
    }


def _operations(export: Export) -> dict[str, int]:
    """For one decision; none of it depends on the readings."""
    return {
        "multiply_accumulates": sum(weight.size for weight, _ in named_layers(export.policy).values()),
        "tanh": _tangents(export),
    }


def _tangents(export: Export) -> int:
    """One for each hidden unit, and three for each cell: two gates and the candidate."""
    return sum(len(bias) for _, bias in export.policy.layers[:-1]) + 3 * export.policy.cells
