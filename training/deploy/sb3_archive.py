"""A policy from the .zip that `model.save` of stable-baselines3 writes.

No code of the archive runs: weights are loaded as tensors alone, and of the rest only its readable text
is used, not the pickled objects beside it.
"""

import io
import json
import re
import zipfile
from pathlib import Path
from typing import Any

import torch

from controllers.learned import LearnedPolicy
from epv_env.observation import LAYOUT
from training.deploy.quantisation import ExportError

LARGEST = 100_000_000
"""Bytes of a part of an archive, at most: the policies that can be exported have a thousandth of it."""
ACTOR = re.compile(r"(mlp_extractor\.policy_net\.\d+|action_net)\.(weight|bias)")
"""Names of the actor's tensors."""
HIDDEN = re.compile(r"mlp_extractor\.policy_net\.\d+\.")
"""How names of its hidden layers begin."""
CRITIC = re.compile(r"(mlp_extractor\.value_net\.\d+|value_net)\.(weight|bias)")
"""Names of the critic's, which no controller needs."""
REMEDY = "train PPO or A2C with MlpPolicy, tanh, on EPValve-v0"


def read_sb3_archive(path: Path) -> tuple[LearnedPolicy, dict[str, Any]]:
    """The actor of an archive as a policy, and where it comes from.

    Raises ExportError for a file that is no such archive, or another kind of policy.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(_part(archive, "data"))
            tensors = torch.load(io.BytesIO(_part(archive, "policy.pth")), weights_only=True)
    except Exception as error:  # torch's reader raises whatever it meets in damaged bytes
        fault = " ".join(str(error).split())[:120]
        raise ExportError(
            f"cannot read {path} as an archive of stable-baselines3: {fault}; give what model.save wrote"
        ) from None
    _check_activation(path, data)
    layers = _layers(path, tensors)
    provenance = {"source": f"stable-baselines3 archive {path.name}"}
    return LearnedPolicy(layers=layers, name=path.stem), provenance


def _part(archive: zipfile.ZipFile, name: str) -> bytes:
    """A part of the archive. Raises ValueError if it is too large, KeyError if it is missing."""
    size = archive.getinfo(name).file_size
    if size > LARGEST:
        raise ValueError(f"{name} has {size} bytes, more than any policy that can be exported")
    return archive.read(name)


def _check_activation(path: Path, data: Any) -> None:
    """Raises ExportError unless the layers are tanh layers, as they are if nothing is said."""
    chosen = data.get("policy_kwargs") if isinstance(data, dict) else None
    activation = chosen.get("activation_fn") if isinstance(chosen, dict) else None
    if not isinstance(data, dict) or activation not in (None, str(torch.nn.Tanh)):
        raise ExportError(f"the policy in {path} has activation {activation!r}, not tanh: {REMEDY}")


def _layers(path: Path, tensors: Any) -> list[tuple[Any, Any]]:
    """Weight (outputs, inputs) and bias (outputs,) of the actor's layers. Raises ExportError."""
    named = tensors if isinstance(tensors, dict) else {}
    foreign = [
        str(name) for name in named if not (ACTOR.fullmatch(str(name)) or CRITIC.fullmatch(str(name)))
    ]
    places = sorted({int(name.split(".")[2]) for name in map(str, named) if HIDDEN.match(name)})
    names = [*(f"mlp_extractor.policy_net.{k}" for k in places), "action_net"]
    wanted = [f"{name}.{part}" for name in names for part in ("weight", "bias")]
    missing = [name for name in wanted if not isinstance(named.get(name), torch.Tensor)]
    if foreign or missing:
        fault = f"it has {foreign[0]}" if foreign else f"it lacks {missing[0]}"
        raise ExportError(
            f"the policy in {path} is not a plain multilayer perceptron ({fault}): {REMEDY}"
        )
    layers = [
        (named[f"{name}.weight"].float().numpy(), named[f"{name}.bias"].float().numpy())
        for name in names
    ]
    width = len(LAYOUT)
    for weight, bias in layers:
        if weight.ndim != 2 or weight.shape != (len(bias), width):
            raise ExportError(
                f"the policy in {path} has a layer of shape {weight.shape} for {width} inputs: {REMEDY}"
            )
        width = len(bias)
    return layers
