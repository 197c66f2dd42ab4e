"""Writing a policy as safetensors and a contract, which others can load without running code."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from numpy.typing import NDArray
from safetensors.numpy import save
from stable_baselines3 import PPO

from controllers.learned import LearnedPolicy
from controllers.policy_contract import CONTRACT_FILE, FORMAT, WEIGHTS_FILE
from epv_env.common.files import write_bytes, write_json
from epv_env.observation import contract
from training.learners.recurrent_actor_critic import RecurrentActorCritic


def greedy_policy(model: PPO, student: LearnedPolicy | None = None) -> LearnedPolicy:
    """The model's actor as a controller. It shares the model's weights: training changes it.

    student: the policy that the model went on from; its recurrent unit and its name are kept, unless
    the model has learned a unit of its own.
    Raises TypeError for a policy that is not a plain multilayer perceptron with tanh layers.
    """
    if isinstance(model.policy, RecurrentActorCritic):
        return model.policy.greedy()
    layers = [(_array(layer.weight), _array(layer.bias)) for layer in _linear_layers(model)]
    return replace(student, layers=layers) if student else LearnedPolicy(layers=layers)


def put_student(model: PPO, student: LearnedPolicy, sharpness: float) -> None:
    """Make the model's actor a recurrent student, the unit included; logits times `sharpness`."""
    assert isinstance(model.policy, RecurrentActorCritic)
    model.policy.go_on_from(student, sharpness)


def put_layers(model: PPO, policy: LearnedPolicy, sharpness: float) -> None:
    """Copy the policy's layers into the model's actor, of the same shapes; logits times `sharpness`."""
    *hidden, (weight, bias) = policy.layers
    layers = [*hidden, (sharpness * weight, sharpness * bias)]
    for layer, (weight, bias) in zip(_linear_layers(model), layers, strict=True):
        layer.load_state_dict({"weight": torch.as_tensor(weight), "bias": torch.as_tensor(bias)})


def save_policy(
    policy: LearnedPolicy, folder: Path, *, control_period: float, provenance: dict[str, Any]
) -> None:
    """Write a policy's weights, and the meaning of its inputs and outputs.

    Args:
        policy: to write.
        folder: to write into.
        control_period: of the observations [s].
        provenance: of the training, ready for JSON.
    """
    memory = None if policy.cell is None else {"unit": "GRU", "cells": policy.cell.width}
    content = {
        "format": FORMAT,
        "name": policy.name,
        "environment": policy.environment,
        "memory": memory,
        "layers": len(policy.layers),
        "activation": "tanh",
        "action": "argmax of the logits: 0 = coil off, 1 = coil on",
        "observation": contract(control_period),
        "provenance": provenance,
    }
    write_bytes(folder / WEIGHTS_FILE, policy_bytes(policy))
    write_json(folder / CONTRACT_FILE, content)


def policy_bytes(policy: LearnedPolicy) -> bytes:
    """A policy's weights as safetensors."""
    arrays = {}
    for i, (weight, bias) in enumerate(policy.layers):
        arrays[f"{i}.weight"], arrays[f"{i}.bias"] = weight, bias
    if policy.cell is not None:
        arrays |= {f"memory.{name}": array for name, array in vars(policy.cell).items()}
    return save(arrays)


def _linear_layers(model: PPO) -> list[torch.nn.Linear]:
    hidden = list(model.policy.mlp_extractor.policy_net)
    if any(not isinstance(m, (torch.nn.Linear, torch.nn.Tanh)) for m in hidden):
        raise TypeError("only policies of linear and tanh layers can be written")
    return [m for m in [*hidden, model.policy.action_net] if isinstance(m, torch.nn.Linear)]


def _array(parameter: torch.Tensor) -> NDArray:
    return parameter.detach().cpu().numpy()
