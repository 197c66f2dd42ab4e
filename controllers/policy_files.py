"""A learned policy's network and its files: safetensors, and the contract that says what they mean.

Loading a policy runs no code from its files: the weights are arrays, the contract is checked data.
"""

import json
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from controllers.knowledge import INPUTS, RULES
from controllers.network import Network
from controllers.valve_learner import LEARNT
from epv_env.common.files import JSONFileError, digest, read_bytes, read_json, write_bytes, write_json
from epv_env.observation import contract

FORMAT = "epv-policy/2"
WEIGHTS_FILE = "policy.safetensors"
CONTRACT_FILE = "policy.json"
MOST_LAYERS = 64
"""More than any policy has; a number of layers beyond is a damaged file."""
ADVICE = "advice.weight"
"""Name of the array of the advice's weights."""

ControlPeriod = Annotated[float, msgspec.Meta(ge=0.5e-3, le=0.1)]
"""Time between two decisions, as an environment allows it [s]."""


class PolicyError(ValueError):
    """A policy cannot be used here: the message says why and what to do."""


class Observation(msgspec.Struct, kw_only=True):
    """What the policy reads, as `epv_env.observation.contract` writes it."""

    control_period_s: ControlPeriod
    """Time between two observations [s]."""
    format: str = ""
    """Version of the layout's form."""
    entries: list[Any] = []
    """The layout: name, unit and scaling of each entry."""


class PolicyContract(msgspec.Struct, kw_only=True):
    """The fields of policy.json."""

    format: str
    """Version of this form."""
    layers: Annotated[int, msgspec.Meta(ge=1, le=MOST_LAYERS)]
    """Number of dense layers."""
    observation: Observation
    """The readings: the first inputs."""
    learnt: list[Any] = []
    """The learnt quantities, the inputs behind them: name, unit and scaling of each entry."""
    rules: list[str] = []
    """The rules in front of the network."""
    name: str = "PPO"
    """In tables and figures."""
    environment: Literal["EPValve-v0"] = "EPValve-v0"
    """Id of the environment whose actions the policy chooses."""
    activation: Literal["tanh"] = "tanh"
    """Of all layers but the last."""
    action: str = ""
    """What the network's outputs mean, for readers."""
    provenance: dict[str, Any] = {}
    """Of the training, free-form."""


def learnt_contract() -> list[dict[str, Any]]:
    """The learnt quantities as data."""
    return [vars(quantity) for quantity in LEARNT]


def holds_policy(folder: Path) -> bool:
    """Whether a policy has been written into a folder: its contract is written last."""
    return (folder / CONTRACT_FILE).exists()


def policy_digest(folder: Path) -> str:
    """Of all that a policy's folder says: results of another policy have another digest."""
    return digest(read_bytes(folder / CONTRACT_FILE) + read_bytes(folder / WEIGHTS_FILE))


def write_policy(
    network: Network, folder: Path, *, control_period: float, provenance: dict[str, Any]
) -> None:
    """Write a policy's weights, and the meaning of its inputs and outputs.

    Args:
        network: to write.
        folder: to write into.
        control_period: of the observations [s].
        provenance: of the training, ready for JSON.
    """
    arrays = {ADVICE: network.advice_weight}
    for i, (weight, bias) in enumerate(network.layers):
        arrays[f"{i}.weight"], arrays[f"{i}.bias"] = weight, bias
    content = {
        "format": FORMAT,
        "name": "PPO",
        "environment": "EPValve-v0",
        "layers": len(network.layers),
        "activation": "tanh",
        "action": "argmax of the logits plus the advice times its weights: 0 = coil off, 1 = coil on",
        "rules": list(RULES),
        "observation": contract(control_period),
        "learnt": learnt_contract(),
        "provenance": provenance,
    }
    write_bytes(folder / WEIGHTS_FILE, save(arrays))
    write_json(folder / CONTRACT_FILE, content)


def read_policy(folder: str | PathLike[str]) -> tuple[PolicyContract, Network]:
    """Contract and network of a policy's folder.

    Raises PolicyError if a file is missing or damaged, if an array is not what the contract says, or if
    the policy was trained on other inputs than this version's.
    """
    if not isinstance(folder, (str, PathLike)):
        raise PolicyError(f"a policy is {folder!r}: give the path of a folder that training wrote")
    folder = Path(folder)
    found = read_contract(folder)
    try:
        arrays = load(read_bytes(folder / WEIGHTS_FILE))
    # KeyError: a type of numbers that NumPy does not know
    except (OSError, ValueError, KeyError, SafetensorError) as error:
        raise PolicyError(
            f"cannot read a policy from {folder}: {error}; give a folder that training wrote, with "
            f"{CONTRACT_FILE} and {WEIGHTS_FILE}"
        ) from None
    _check_arrays(arrays, found, folder)
    layers = [(arrays[f"{i}.weight"], arrays[f"{i}.bias"]) for i in range(found.layers)]
    return found, Network(layers=layers, advice_weight=arrays[ADVICE])


def read_contract(folder: Path) -> PolicyContract:
    """A policy folder's contract. Raises PolicyError if it is missing, damaged or of other inputs."""
    remedy = (
        f"train it anew, or give a folder that training wrote, with {CONTRACT_FILE} and {WEIGHTS_FILE}"
    )
    try:
        found = read_json(folder / CONTRACT_FILE, PolicyContract, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise PolicyError(f"cannot read a policy from {folder}: {error}") from None
    expected = contract(found.observation.control_period_s), learnt_contract(), list(RULES)
    own = msgspec.to_builtins(found.observation), found.learnt, found.rules
    if list(own) != json.loads(json.dumps(expected)):
        raise PolicyError(
            f"policy {folder} was trained on other observations, learnt quantities or rules than this "
            "version's: train it anew, or use the version that wrote it"
        )
    return found


def _check_arrays(arrays: dict[str, NDArray], found: PolicyContract, folder: Path) -> None:
    """Raises PolicyError unless the arrays have the contract's shapes, one precision, finite values."""
    shapes: dict[str, tuple[int, ...]] = {ADVICE: (2,)}
    inputs = INPUTS
    for i in range(found.layers):
        bias = arrays.get(f"{i}.bias", np.zeros(0))  # the width of a hidden layer is the policy's own
        outputs = 2 if i == found.layers - 1 else len(bias) if bias.ndim == 1 else 1
        shapes |= {f"{i}.weight": (outputs, inputs), f"{i}.bias": (outputs,)}
        inputs = outputs
    for name, shape in shapes.items():
        if name not in arrays:
            raise PolicyError(
                f"policy {folder} lacks the array {name!r} in {WEIGHTS_FILE}: train it anew"
            )
        array, wrong = arrays[name], None
        if array.shape != shape or array.size == 0:
            wrong = f"shape {array.shape}, not {shape}"
        elif array.dtype not in ("float32", "float64") or array.dtype != arrays[ADVICE].dtype:
            wrong = f"type {array.dtype}, where all arrays are float32, or all float64"
        elif not bool(abs(array).max(initial=0.0) < float("inf")):
            wrong = "values that are not finite"
        if wrong:
            raise PolicyError(f"array {name!r} of policy {folder} has {wrong}: train it anew")
