"""The contract of an export: all that whoever builds it in has to know, as data."""

from typing import Any

from epv_env.observation import HISTORY, LAYOUT, LONGEST_WAIT, P2_LAGS, P3_LAGS, contract
from training.ecu.compiled import MEMORY_TYPE
from training.ecu.quantise import FULL, ONE, UNITS
from training.ecu.sources import Export

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
        },
        "actions": {"0": "coil off: the protection valve opens", "1": "coil on: it shuts"},
        "decision": "0 if the logit of off is at least the logit of on, else 1",
        "timing": "read, decide and switch at each period's start; the coil stays so through it",
        "variants": {
            "onnx": {
                "files": ["policy.onnx"],
                "input": "observation: (batch, entries) float32",
                "outputs": {"logits": "(batch, 2) float32: off, on", "action": "(batch,) int64"},
            },
            "float": _float(export),
            "fixed": _fixed(export),
        },
    }


def _float(export: Export) -> dict[str, Any]:
    weights = sum(weight.size + bias.size for weight, bias in export.policy.layers)
    return {
        "files": ["epv_float.h", "epv_float.c"],
        "readings": {"pressure": "bar absolute", "current": "A"},
        "operations": _operations(export) | {"divisions": _hidden(export) + len(LAYOUT)},
        "bytes": {
            "constants": 4 * (weights + 3 * len(LAYOUT)),
            "memory_of_a_valve": MEMORY_TYPE["float"].itemsize,
            "buffers_on_the_stack": 4 * (2 * export.widest + 2 * len(LAYOUT)),
        },
    }


def _fixed(export: Export) -> dict[str, Any]:
    layers, inputs = export.fixed.layers, export.fixed.inputs
    rows = sum(len(layer.bias) for layer in layers)
    constants = sum(layer.weight.nbytes + layer.factor.nbytes + layer.bias.nbytes for layer in layers)
    return {
        "files": ["epv_fixed.h", "epv_fixed.c"],
        "readings": {"pressure": "Pa absolute", "current": "uA"},
        "arithmetic": "weights int8, a scale for each row; observation, activations int16; sums int32",
        "one": {"activations": FULL, "logits": ONE},
        "observation": [
            {"name": q.name, "unit": UNITS[q.unit][0], "centre": int(centre), "reach": int(reach)}
            for q, centre, reach in zip(LAYOUT, inputs.centre, inputs.reach, strict=True)
        ],
        "operations": _operations(export)
        | {"scalings_by_32x32_bits": rows + len(LAYOUT), "divisions": 0},
        "bytes": {
            "constants": constants + export.fixed.tangent.nbytes + 12 * len(LAYOUT),
            "memory_of_a_valve": MEMORY_TYPE["fixed"].itemsize,
            "buffers_on_the_stack": 2 * (2 * export.widest + len(LAYOUT)) + 8 * len(LAYOUT),
        },
    }


def _operations(export: Export) -> dict[str, int]:
    """For one decision; none of it depends on the readings."""
    return {
        "multiply_accumulates": sum(weight.size for weight, _ in export.policy.layers),
        "tanh": _hidden(export),
    }


def _hidden(export: Export) -> int:
    return sum(len(bias) for _, bias in export.policy.layers[:-1])
