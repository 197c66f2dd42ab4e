"""A policy as an ONNX model, built node by node from its weights."""

import json

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from controllers.learned import GatedUnit, LearnedPolicy
from epv_env.observation import LAYOUT, contract

OPSET = 17
IR_VERSION = 8
"""The format that goes with this operator set: old enough for every runtime in use."""


def onnx_model(policy: LearnedPolicy, *, period: float) -> onnx.ModelProto:
    """Input `observation` (batch, entries) float32; outputs `logits` (batch, 2) and `action` (batch,).

    A policy with a memory has the input `memory` (batch, cells) and the output `next_memory` besides.
    The observation's layout is in the metadata. Raises onnx.checker.ValidationError if it is not valid.
    """
    inputs = [_floats("observation", len(LAYOUT))]
    outputs = [
        _floats("logits", 2),
        helper.make_tensor_value_info("action", TensorProto.INT64, ["batch"]),
    ]
    nodes, weights, signal = [], [], "observation"
    if policy.cell is not None:
        inputs.append(_floats("memory", policy.cells))
        outputs.append(_floats("next_memory", policy.cells))
        nodes, weights = _unit(policy.cell)
        signal = "seen"
    for k, (weight, bias) in enumerate(policy.layers):
        last = k == len(policy.layers) - 1
        names = [f"weight_{k}", f"bias_{k}"]
        weights += [_constant(weight, names[0]), _constant(bias, names[1])]
        result = "logits" if last else f"sum_{k}"
        nodes.append(helper.make_node("Gemm", [signal, *names], [result], transB=1))
        if not last:
            signal = f"tanh_{k}"
            nodes.append(helper.make_node("Tanh", [result], [signal]))
    nodes.append(helper.make_node("ArgMax", ["logits"], ["action"], axis=1, keepdims=0))
    model = helper.make_model(
        helper.make_graph(nodes, "policy", inputs, outputs, weights),
        producer_name="epv-valve",
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
    )
    helper.set_model_props(model, {"observation": json.dumps(contract(period))})
    onnx.checker.check_model(model, full_check=True)
    return model


def _unit(unit: GatedUnit) -> tuple[list[NodeProto], list[TensorProto]]:
    """The standard operator for one period, and what the layers see after it: `seen`.

    It takes a sequence, here of length one, so that a first axis comes and goes.
    """
    biases = np.concatenate([_ordered(unit.bias_input), _ordered(unit.bias_memory)])
    weights = [
        _constant(_ordered(unit.weight_input)[None], "weight_new"),
        _constant(_ordered(unit.weight_memory)[None], "weight_old"),
        _constant(biases[None], "bias_unit"),
        numpy_helper.from_array(np.array([0], dtype=np.int64), "sequence"),
    ]
    # Its reset gate acts on the candidate's row of the old cells, bias included, as torch's does.
    gru = helper.make_node(
        "GRU",
        ["observations", "weight_new", "weight_old", "bias_unit", "", "memories"],
        ["", "next_memories"],
        hidden_size=unit.width,
        linear_before_reset=1,
    )
    nodes = [
        helper.make_node("Unsqueeze", ["observation", "sequence"], ["observations"]),
        helper.make_node("Unsqueeze", ["memory", "sequence"], ["memories"]),
        gru,
        helper.make_node("Squeeze", ["next_memories", "sequence"], ["next_memory"]),
        helper.make_node("Concat", ["observation", "next_memory"], ["seen"], axis=1),
    ]
    return nodes, weights


def _ordered(rows: NDArray) -> NDArray:
    """Rows of a (3m, ...) array in the order of ONNX: update gate, reset gate, candidate."""
    reset, update, candidate = np.split(rows, 3)
    return np.concatenate([update, reset, candidate])


def _floats(name: str, width: int) -> ValueInfoProto:
    """An input or output (batch, width) of float32."""
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width])


def _constant(values: NDArray, name: str) -> TensorProto:
    """A constant of float32, values of any shape."""
    return numpy_helper.from_array(np.ascontiguousarray(values, dtype=np.float32), name)
