"""Writing a policy so that others can load it without running code: safetensors and a contract."""

import json
from pathlib import Path
from typing import Any

import torch
from safetensors.numpy import save
from stable_baselines3 import PPO

from controllers.learned import CONTRACT_FILE, FORMAT, WEIGHTS_FILE
from epv_env.observation import contract
from epv_env.plant.files import write_bytes, write_text


def save_policy(model: PPO, folder: Path, *, control_period: float, provenance: dict[str, Any]) -> None:
    """Write the actor's weights and what its inputs and outputs mean.

    Raises TypeError for a policy that is not a plain multilayer perceptron with tanh layers.
    """
    layers = _linear_layers(model)
    arrays = {}
    for i, layer in enumerate(layers):
        arrays[f"{i}.weight"] = layer.weight.detach().cpu().numpy()
        arrays[f"{i}.bias"] = layer.bias.detach().cpu().numpy()
    content = {
        "format": FORMAT,
        "environment": "EPValve-v0",
        "layers": len(layers),
        "activation": "tanh",
        "action": "argmax of the logits: 0 = coil off, 1 = coil on",
        "observation": contract(control_period),
        "provenance": provenance,
    }
    write_bytes(folder / WEIGHTS_FILE, save(arrays))
    write_text(folder / CONTRACT_FILE, json.dumps(content, indent=1) + "\n")


def _linear_layers(model: PPO) -> list[torch.nn.Linear]:
    hidden = list(model.policy.mlp_extractor.policy_net)
    if any(not isinstance(m, (torch.nn.Linear, torch.nn.Tanh)) for m in hidden):
        raise TypeError("only policies of linear and tanh layers can be written")
    return [m for m in [*hidden, model.policy.action_net] if isinstance(m, torch.nn.Linear)]
