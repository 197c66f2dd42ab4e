"""A policy as an ONNX model, built node by node from its weights."""

import json

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from controllers.learned import LearnedPolicy
from epv_env.observation import contract

OPSET = 17
IR_VERSION = 8
"""The format that goes with this operator set: old enough for every runtime in use."""


def onnx_model(policy: LearnedPolicy, *, period: float) -> onnx.ModelProto:
    """Input `observation` (batch, entries) float32; outputs `logits` (batch, 2) and `action` (batch,).

    The observation's layout is in the metadata. Raises onnx.checker.ValidationError if it is not valid.
    """
    nodes, weights = [], []
    signal = "observation"
    for k, (weight, bias) in enumerate(policy.layers):
        last = k == len(policy.layers) - 1
        names = [f"weight_{k}", f"bias_{k}"]
        weights += [
            numpy_helper.from_array(np.ascontiguousarray(array, dtype=np.float32), name)
            for array, name in zip((weight, bias), names, strict=True)
        ]
        result = "logits" if last else f"sum_{k}"
        nodes.append(helper.make_node("Gemm", [signal, *names], [result], transB=1))
        if not last:
            signal = f"tanh_{k}"
            nodes.append(helper.make_node("Tanh", [result], [signal]))
    nodes.append(helper.make_node("ArgMax", ["logits"], ["action"], axis=1, keepdims=0))
    entries = policy.layers[0][0].shape[1]
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["batch", entries])],
        [
            helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["batch", 2]),
            helper.make_tensor_value_info("action", TensorProto.INT64, ["batch"]),
        ],
        weights,
    )
    model = helper.make_model(
        graph,
        producer_name="epv-valve",
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
    )
    helper.set_model_props(model, {"observation": json.dumps(contract(period))})
    onnx.checker.check_model(model, full_check=True)
    return model
