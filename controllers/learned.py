"""A learned policy as a controller: its weights come as safetensors, their meaning as JSON.

Loading a policy runs no code from its files: the weights are arrays, the contract is data. The
network is a multilayer perceptron, with a gated recurrent unit before it if the policy is recurrent.
"""

from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load

from controllers.dense_layer import dense_layer
from controllers.policy_contract import (
    CONTRACT_FILE,
    WEIGHTS_FILE,
    PolicyError,
    check_arrays,
    read_contract,
)
from epv_env.common.files import read_bytes

TRAINED = Path(__file__).parent / "trained"
"""The policies that come with the package, one of each kind: recurrent/seed-7 (with a memory),
end-to-end/seed-0 (with one that has learned with PPO, too) and plain/seed-0 (without one)."""


@dataclass(frozen=True, kw_only=True)
class GatedUnit:
    """A gated recurrent unit of m cells (Cho et al., EMNLP 2014), its arrays as torch.nn.GRU has them.

    The rows of all four arrays belong to the reset gate, the update gate and the candidate, m each.
    """

    weight_input: NDArray
    """Weights of the input (3m, inputs)."""
    weight_memory: NDArray
    """Weights of the recurrent state (3m, m)."""
    bias_input: NDArray
    """Bias of the input (3m,)."""
    bias_memory: NDArray
    """Bias of the recurrent state (3m,)."""

    @property
    def width(self) -> int:
        """Number of cells m."""
        return self.weight_memory.shape[1]

    def step(self, observations: NDArray, memory: NDArray) -> NDArray:
        """The recurrent state (n, m) that follows `memory` (n, m) after observations (n, inputs)."""
        new = dense_layer(observations, self.weight_input, self.bias_input)
        old = dense_layer(memory, self.weight_memory, self.bias_memory)
        m = self.width
        gates = _logistic(new[:, : 2 * m] + old[:, : 2 * m])
        reset, update = gates[:, :m], gates[:, m:]
        candidate = np.tanh(new[:, 2 * m :] + reset * old[:, 2 * m :])
        return (1 - update) * candidate + update * memory


@dataclass(kw_only=True)
class LearnedPolicy:
    """Greedy actions of a multilayer perceptron with tanh layers; Discrete actions only."""

    layers: list[tuple[NDArray, NDArray]]
    """Weight (outputs, inputs) and bias (outputs,) of each layer; the last gives the logits."""
    cell: GatedUnit | None = None
    """Recurrent unit: the layers see its state beside the observation. None: no memory."""
    name: str = "PPO"
    environment: str = "EPValve-v0"
    _memory: NDArray = field(init=False, repr=False, default_factory=lambda: np.empty((0, 0)))

    @property
    def cells(self) -> int:
        """Size of the recurrent state; 0 for a policy without memory."""
        return 0 if self.cell is None else self.cell.width

    @property
    def memory(self) -> NDArray:
        """Recurrent state (n, cells)."""
        return self._memory

    @property
    def precision(self) -> np.dtype:
        """Precision of the weights, and so of all results: single, as training writes it."""
        return self.layers[0][0].dtype

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        self._memory = np.zeros((n, self.cells), dtype=self.precision)

    def act(self, observations: NDArray) -> NDArray:
        """The action with the largest logit for each valve, (n,)."""
        return np.argmax(self.logits(observations), axis=1)

    def logits(self, observations: NDArray) -> NDArray:
        """Logits (n, actions) of observations (n, entries); the recurrent state advances a period."""
        signal = observations.astype(self.precision)
        if self.cell is not None:
            self._memory = self.cell.step(signal, self._memory)
            signal = np.concatenate([signal, self._memory], axis=1)
        for weight, bias in self.layers[:-1]:
            signal = np.tanh(dense_layer(signal, weight, bias))
        return dense_layer(signal, *self.layers[-1])


def _logistic(signal: NDArray) -> NDArray:
    """1 / (1 + exp(-signal)), without overflow."""
    return 0.5 + 0.5 * np.tanh(0.5 * signal)


def holds_policy(folder: Path) -> bool:
    """Whether a policy has been written into a folder: its contract is written last."""
    return (folder / CONTRACT_FILE).exists()


def load_policy(folder: str | PathLike[str]) -> LearnedPolicy:
    """A policy from its folder (policy.safetensors and policy.json).

    Raises PolicyError if a file is missing or damaged, if an array is not what the contract says, or if
    the policy was trained on another observation layout than this version's.
    """
    folder = Path(folder)
    found = read_contract(folder)
    try:
        arrays = load(read_bytes(folder / WEIGHTS_FILE))
    except (OSError, ValueError, SafetensorError) as error:
        raise PolicyError(
            f"cannot read a policy from {folder}: {error}; give a folder that training wrote, with "
            f"{CONTRACT_FILE} and {WEIGHTS_FILE}"
        ) from None
    check_arrays(arrays, found, folder)
    layers = [(arrays[f"{i}.weight"], arrays[f"{i}.bias"]) for i in range(found.layers)]
    cell = _unit(arrays) if found.memory else None
    return LearnedPolicy(layers=layers, cell=cell, name=found.name, environment=found.environment)


def _unit(arrays: dict[str, NDArray]) -> GatedUnit:
    """The recurrent unit among a policy's arrays."""
    return GatedUnit(**{entry.name: arrays[f"memory.{entry.name}"] for entry in fields(GatedUnit)})
