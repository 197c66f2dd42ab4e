"""The contract of a learned policy, policy.json: what its weights mean; every field is checked."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from numpy.typing import NDArray

from epv_env import MAX_EPISODE_STEPS
from epv_env.common.files import JSONFileError, read_json
from epv_env.observation import LAYOUT, contract

FORMAT = "epv-policy/1"
WEIGHTS_FILE = "policy.safetensors"
CONTRACT_FILE = "policy.json"
MOST_LAYERS = 64
"""More than any policy has; a number of layers beyond is a damaged file."""

ControlPeriod = Annotated[float, msgspec.Meta(ge=0.5e-3, le=0.1)]
"""Time between two decisions, as an environment allows it [s]."""


class PolicyError(ValueError):
    """A policy cannot be used here: the message says why and what to do."""


class Memory(msgspec.Struct, kw_only=True):
    """The recurrent unit."""

    unit: Literal["GRU"]
    """Its kind."""
    cells: Annotated[int, msgspec.Meta(ge=1, le=4096)]
    """Size of its state."""


class Observation(msgspec.Struct, kw_only=True):
    """What the policy observes, as `epv_env.observation.contract` writes it."""

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
    environment: str
    """Id of the environment whose actions the policy chooses."""
    layers: Annotated[int, msgspec.Meta(ge=1, le=MOST_LAYERS)]
    """Number of dense layers."""
    observation: Observation
    """What it observes."""
    name: str = "PPO"
    """In tables and figures."""
    activation: Literal["tanh"] = "tanh"
    """Of all layers but the last; only this one is computed here and in exported code."""
    memory: Memory | None = None
    """Recurrent unit before the layers; None: no memory."""
    provenance: dict[str, Any] = {}
    """Of the training, free-form."""


def read_contract(folder: Path) -> PolicyContract:
    """A policy folder's contract. Raises PolicyError if it is missing, damaged or of another layout."""
    remedy = (
        f"train it anew, or give a folder that training wrote, with {CONTRACT_FILE} and {WEIGHTS_FILE}"
    )
    try:
        found = read_json(folder / CONTRACT_FILE, PolicyContract, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise PolicyError(f"cannot read a policy from {folder}: {error}") from None
    if found.environment not in MAX_EPISODE_STEPS:
        raise PolicyError(
            f"policy {folder} acts in {found.environment!r}, no environment of this version: {remedy}"
        )
    expected = contract(found.observation.control_period_s)
    if msgspec.to_builtins(found.observation) != json.loads(json.dumps(expected)):
        raise PolicyError(
            f"policy {folder} was trained on another observation layout than this version's: "
            "train it anew, or use the version that wrote it"
        )
    return found


def array_shapes(arrays: dict[str, NDArray], found: PolicyContract, folder: Path) -> dict[str, tuple]:
    """The shape that each array of a policy has to have, by name.

    The widths of hidden layers are the policy's own: the bias of a layer says them.
    Raises PolicyError if an array is missing or a bias is no vector.
    """
    shapes: dict[str, tuple] = {}
    inputs = len(LAYOUT)
    if found.memory is not None:
        m = found.memory.cells
        shapes |= {
            "memory.weight_input": (3 * m, inputs), "memory.weight_memory": (3 * m, m),
            "memory.bias_input": (3 * m,), "memory.bias_memory": (3 * m,),
        }  # fmt: skip
        inputs += m
    for i in range(found.layers):
        bias = arrays.get(f"{i}.bias")
        outputs = len(bias) if bias is not None and bias.ndim == 1 else 1
        shapes |= {f"{i}.weight": (outputs, inputs), f"{i}.bias": (outputs,)}
        inputs = outputs
    if missing := [name for name in shapes if name not in arrays]:
        raise PolicyError(
            f"policy {folder} lacks the array {missing[0]!r} in {WEIGHTS_FILE}: train it anew"
        )
    return shapes


def check_arrays(arrays: dict[str, NDArray], found: PolicyContract, folder: Path) -> None:
    """Raises PolicyError unless the arrays have the contract's shapes, one precision, finite values."""
    for name, shape in array_shapes(arrays, found, folder).items():
        array = arrays[name]
        wrong = None
        if array.shape != shape:
            wrong = f"shape {array.shape}, not {shape}"
        elif array.dtype not in ("float32", "float64") or array.dtype != arrays["0.weight"].dtype:
            wrong = f"type {array.dtype}, where all arrays are float32, or all float64"
        elif not bool(abs(array).max(initial=0.0) < float("inf")):
            wrong = "values that are not finite"
        if wrong:
            raise PolicyError(f"array {name!r} of policy {folder} has {wrong}: train it anew")
    actions = len(arrays[f"{found.layers - 1}.bias"])
    if actions < 2:
        raise PolicyError(f"policy {folder} chooses among {actions} actions, not 2: train it anew")
