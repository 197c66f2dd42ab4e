"""A policy as an ONNX model, built node by node from its weights."""

import json

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from controllers.learned import LearnedPolicy
from epv_env.observation import LAYOUT, contract

OPSET = 17
IR_VERSION = 8
"""The format that goes with this operator set: old enough for every runtime in use."""


def onnx_model(policy: LearnedPolicy, *, period: float) -> onnx.ModelProto:
    """Input `observation` (batch, entries) float32; outputs `logits` (batch, 2) and `action` (batch,).

    The observation's layout is in the metadata. Raises onnx.checker.ValidationError if it is not valid.
    """
    inputs = [_floats("observation", len(LAYOUT))]
    outputs = [
        _floats("logits", 2),
        helper.make_tensor_value_info("action", TensorProto.INT64, ["batch"]),
    ]
    nodes: list[NodeProto] = []
    weights: list[TensorProto] = []
    signal = "observation"
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


def _floats(name: str, width: int) -> ValueInfoProto:
    """An input or output (batch, width) of float32."""
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width])


def _constant(values: NDArray, name: str) -> TensorProto:
    """A constant of float32, values of any shape."""
    return numpy_helper.from_array(np.ascontiguousarray(values, dtype=np.float32), name)
