"""A trained policy behind the controllers' protocol: weights as safetensors, meaning as JSON.

Nothing here runs code from a file: the weights are arrays, the contract is data, the network is the
multilayer perceptron below.
"""

import json
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file

from controllers.dense import dense
from epv_env.observation import contract

FORMAT = "epv-policy/1"
WEIGHTS_FILE = "policy.safetensors"
CONTRACT_FILE = "policy.json"


class PolicyError(ValueError):
    """A policy cannot be used here: the message says why and what to do."""


@dataclass(kw_only=True)
class LearnedPolicy:
    """Greedy actions of a multilayer perceptron with tanh layers; Discrete actions only."""

    layers: list[tuple[NDArray, NDArray]]
    """Weight (outputs, inputs) and bias (outputs,) of each layer; the last gives the logits."""
    name: str = "PPO"
    environment: str = "EPValve-v0"

    def reset(self, n: int) -> None:
        """Nothing to forget: the policy has no memory of its own."""

    def act(self, observations: NDArray) -> NDArray:
        """The action with the largest logit for each valve."""
        signal = observations.astype(np.float32)
        for weight, bias in self.layers[:-1]:
            signal = np.tanh(dense(signal, weight, bias))
        return np.argmax(dense(signal, *self.layers[-1]), axis=1)


def load_policy(folder: str | PathLike[str]) -> LearnedPolicy:
    """A policy from its folder (policy.safetensors and policy.json).

    Raises PolicyError if a file is missing or damaged, or if the policy was trained on another
    observation layout than this version's.
    """
    folder = Path(folder)
    try:
        content: dict[str, Any] = json.loads((folder / CONTRACT_FILE).read_text(encoding="utf-8"))
        arrays = load_file(folder / WEIGHTS_FILE)
    except (OSError, json.JSONDecodeError, SafetensorError) as error:
        raise PolicyError(
            f"cannot read a policy from {folder}: {error}; give a folder that training wrote, with "
            f"{CONTRACT_FILE} and {WEIGHTS_FILE}"
        ) from None
    if content.get("format") != FORMAT:
        raise PolicyError(
            f"policy {folder} has format {content.get('format')!r}, this version reads {FORMAT!r}: "
            "train it anew"
        )
    missing = {"environment", "layers", "observation"} - content.keys()
    if missing:
        raise PolicyError(
            f"policy {folder} lacks {', '.join(sorted(missing))} in {CONTRACT_FILE}: train it anew"
        )
    expected = contract(content["observation"]["control_period_s"])
    if content["observation"] != json.loads(json.dumps(expected)):
        raise PolicyError(
            f"policy {folder} was trained on another observation layout than this version's: "
            "train it anew, or use the version that wrote it"
        )
    layers = [(arrays[f"{i}.weight"], arrays[f"{i}.bias"]) for i in range(content["layers"])]
    return LearnedPolicy(layers=layers, environment=content["environment"])
