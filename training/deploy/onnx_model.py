"""A policy as an ONNX model, built node by node from its weights."""

import json

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from controllers.policy_files import Network, learnt_contract
from epv_env.observation import contract

OPSET = 17
IR_VERSION = 8
"""The format that goes with this operator set: old enough for every runtime in use."""


def onnx_model(network: Network, *, period: float) -> onnx.ModelProto:
    """Input `inputs` (batch, all) float32; outputs `logits` (batch, 2) and `action` (batch,).

    The layout of readings and learnt quantities is in the metadata. Raises onnx.checker.ValidationError
    if it is not valid."""
    inputs = [_floats("inputs", network.layers[0][0].shape[1])]
    outputs = [
        _floats("logits", 2),
        helper.make_tensor_value_info("action", TensorProto.INT64, ["batch"]),
    ]
    nodes: list[NodeProto] = []
    weights: list[TensorProto] = []
    signal = result = "inputs"
    for k, (weight, bias) in enumerate(network.layers):
        last = k == len(network.layers) - 1
        names = [f"weight_{k}", f"bias_{k}"]
        weights += [_constant(weight, names[0]), _constant(bias, names[1])]
        result = f"sum_{k}"
        nodes.append(helper.make_node("Gemm", [signal, *names], [result], transB=1))
        if not last:
            signal = f"tanh_{k}"
            nodes.append(helper.make_node("Tanh", [result], [signal]))
    last_input = np.array([network.layers[0][0].shape[1] - 1], dtype=np.int64)
    weights.append(numpy_helper.from_array(last_input, "advice_entry"))
    weights.append(_constant(network.advice_weight[None], "advice_weight"))
    nodes.append(helper.make_node("Gather", ["inputs", "advice_entry"], ["advice"], axis=1))
    nodes.append(helper.make_node("MatMul", ["advice", "advice_weight"], ["advised"]))
    nodes.append(helper.make_node("Add", [result, "advised"], ["logits"]))
    nodes.append(helper.make_node("ArgMax", ["logits"], ["action"], axis=1, keepdims=0))
    model = helper.make_model(
        helper.make_graph(nodes, "policy", inputs, outputs, weights),
        producer_name="epv-valve",
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
    )
    layout = {"observation": contract(period), "learnt": learnt_contract()}
    helper.set_model_props(model, {name: json.dumps(entries) for name, entries in layout.items()})
    onnx.checker.check_model(model, full_check=True)
    return model


def _floats(name: str, width: int) -> ValueInfoProto:
    """An input or output (batch, width) of float32."""
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width])


def _constant(values: NDArray, name: str) -> TensorProto:
    """A constant of float32, values of any shape."""
    return numpy_helper.from_array(np.ascontiguousarray(values, dtype=np.float32), name)
