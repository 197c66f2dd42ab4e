"""The recurrent network that learns from a privileged teacher, and its policy."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from controllers.learned import GatedUnit, LearnedPolicy, load_policy
from epv_env.observation import LAYOUT
from training.learners.hyperparameters import FROM_STUDENT, Hyperparameters
from training.learners.run_folder import STUDENT_FOLDER

NAME = "PPO, recurrent"
END_TO_END_NAME = "PPO, end to end"
"""Of a policy whose recurrent unit has learned with PPO, too."""


class Student(torch.nn.Module):
    """A gated recurrent unit followed by two hidden layers of tanh units."""

    def __init__(self, *, memory: int, width: int):
        """memory: cells of the recurrent unit. width: units of each hidden layer."""
        super().__init__()
        entries = len(LAYOUT)
        self.memory = torch.nn.GRU(entries, memory, batch_first=True)
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(entries + memory, width), torch.nn.Tanh(),
            torch.nn.Linear(width, width), torch.nn.Tanh(),
            torch.nn.Linear(width, 1),
        )  # fmt: skip

    def forward(self, observations: torch.Tensor, before: torch.Tensor) -> torch.Tensor:
        """Log odds of energising the coil (windows, periods).

        observations: (windows, periods, entries). before: recurrent state that each window begins with,
        (windows, cells).
        """
        states, _ = self.memory(observations, before[None])
        return self.layers(torch.cat([observations, states], dim=-1))[..., 0]

    def step(
        self, observations: torch.Tensor, memory: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Log odds (n,) after observations (n, entries), and the recurrent state (n, cells) then.

        memory: recurrent state before, (n, cells).
        """
        _, state = self.memory(observations[:, None], memory[None])
        return self.layers(torch.cat([observations, state[0]], dim=-1))[:, 0], state[0]


UNIT = {
    "weight_input": "weight_ih_l0", "weight_memory": "weight_hh_l0", "bias_input": "bias_ih_l0",
    "bias_memory": "bias_hh_l0",
}  # fmt: skip
"""torch's names of a recurrent unit's arrays, by those of GatedUnit."""
LAYERS = (0, 2, 4)
"""Places of the linear layers in `Student.layers`."""


def policy_of(student: Student) -> LearnedPolicy:
    """The student's greedy policy, with a copy of its weights."""
    arrays = {name: tensor.numpy().copy() for name, tensor in student.state_dict().items()}
    cell = GatedUnit(**{name: arrays[f"memory.{own}"] for name, own in UNIT.items()})
    layers = [(arrays[f"layers.{k}.weight"], arrays[f"layers.{k}.bias"]) for k in LAYERS]
    weight, bias = layers[-1]  # the log odds of one action are the logit of the one, 0 of the other
    layers[-1] = np.concatenate([0 * weight, weight]), np.concatenate([0 * bias, bias])
    return LearnedPolicy(layers=layers, cell=cell, name=NAME)


def put_policy(student: Student, policy: LearnedPolicy, sharpness: float = 1.0) -> None:
    """Give a student the weights of a policy of the same shape: the inverse of `policy_of`.

    sharpness: factor of the log odds [1].
    """
    assert policy.cell is not None
    *hidden, (weight, bias) = policy.layers
    last = sharpness * (weight[1:] - weight[:1]), sharpness * (bias[1:] - bias[:1])
    arrays = {f"memory.{own}": getattr(policy.cell, name) for name, own in UNIT.items()}
    for k, (weight, bias) in zip(LAYERS, [*hidden, last], strict=True):
        arrays |= {f"layers.{k}.weight": weight, f"layers.{k}.bias": bias}
    student.load_state_dict({name: torch.as_tensor(array) for name, array in arrays.items()})


def with_memory_of(student: LearnedPolicy, policy: LearnedPolicy) -> LearnedPolicy:
    """A policy without memory that gets the student's recurrent unit, with zero weights on its state.

    It acts as before until it learns more (Net2Net: Chen, Goodfellow and Shlens, ICLR 2016).
    """
    (weight, bias), *rest = policy.layers
    zeros = np.zeros((len(weight), student.cells), dtype=weight.dtype)
    return replace(student, layers=[(np.concatenate([weight, zeros], axis=1), bias), *rest])


def load_student(folder: Path, h: Hyperparameters = FROM_STUDENT) -> LearnedPolicy:
    """A policy that PPO can go on from.

    Raises ValueError if its network has another shape, PolicyError if it is damaged.
    """
    student = load_policy(folder)
    widths = [len(bias) for _, bias in student.layers[:-1]]
    if student.cell is None or widths != [h.width, h.width]:
        raise ValueError(
            f"the policy in {folder} has {student.cells} cells and hidden layers of {widths}: PPO goes "
            f"on from one with a memory and layers of {[h.width, h.width]}, as `python "
            f"training/train_ppo.py` writes into its folder `{STUDENT_FOLDER}`"
        )
    return student
