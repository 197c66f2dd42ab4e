"""Policies for tests: random ones, and ones fitted to a controller, written as training writes them."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save_file

from controllers.base import Controller
from controllers.learned import GatedUnit
from controllers.policy_contract import CONTRACT_FILE, FORMAT, WEIGHTS_FILE
from epv_env.observation import LAYOUT, contract
from training.deploy.agreement import visit

Layers = list[tuple[NDArray, NDArray]]


def random_layers(
    *, seed: int, widths: tuple[int, ...] = (24, 40, 8), outputs: int = 2, cells: int = 0
) -> Layers:
    """A net of tanh layers whose weights mean nothing. cells: of a unit before it."""
    rng = np.random.default_rng(seed)
    sizes = [len(LAYOUT) + cells, *widths, outputs]
    return [
        (
            rng.normal(scale=1.5 / np.sqrt(before), size=(after, before)).astype(np.float32),
            rng.normal(scale=0.3, size=after).astype(np.float32),
        )
        for before, after in pairwise(sizes)
    ]


def random_unit(*, seed: int, cells: int) -> GatedUnit:
    """A gated recurrent unit whose weights mean nothing; it forgets within some ten periods."""
    rng = np.random.default_rng(seed)

    def normal(*shape: int) -> NDArray:
        return rng.normal(scale=0.7, size=shape).astype(np.float32)

    slower = np.repeat(np.array([0, 2, 0], np.float32), cells)  # rows of the update gate
    return GatedUnit(
        weight_input=normal(3 * cells, len(LAYOUT)),
        weight_memory=normal(3 * cells, cells),
        bias_input=normal(3 * cells) + slower,
        bias_memory=normal(3 * cells),
    )


def fitted_layers(controller: Controller, *, seed: int) -> Layers:
    """A net of 64 and 64 units that acts much like a controller.

    The hidden layers are random; the last is fitted by least squares to what the controller decides on
    the states that it visits.
    """
    seen = visit(controller, first_seed=seed, episodes=32, periods=300)
    signal = seen.flat
    hidden = random_layers(seed=seed, widths=(64,), outputs=64)
    for weight, bias in hidden:
        signal = np.tanh(signal @ weight.T + bias)
    columns = np.column_stack([signal, np.ones(len(signal))])
    wanted = np.where(seen.actions.ravel() > 0, 5.0, -5.0)
    solution = np.linalg.lstsq(
        columns.T @ columns + 1e-2 * np.eye(columns.shape[1]), columns.T @ wanted, rcond=None
    )[0]
    last = np.stack([-solution / 2, solution / 2]).astype(np.float32)
    return [*hidden, (np.ascontiguousarray(last[:, :-1]), np.ascontiguousarray(last[:, -1]))]


def write_policy(layers: Layers, folder: Path, unit: GatedUnit | None = None) -> Path:
    """Write a policy's two files; returns the folder."""
    folder.mkdir(parents=True)
    arrays = {}
    for k, (weight, bias) in enumerate(layers):
        arrays |= {f"{k}.weight": weight, f"{k}.bias": bias}
    memory = None
    if unit is not None:
        arrays |= {f"memory.{name}": array for name, array in vars(unit).items()}
        memory = {"unit": "GRU", "cells": unit.width}
    save_file(arrays, folder / WEIGHTS_FILE)
    content = {
        "format": FORMAT,
        "environment": "EPValve-v0",
        "memory": memory,
        "layers": len(layers),
        "observation": contract(0.005),
        "provenance": {},
    }
    (folder / CONTRACT_FILE).write_text(json.dumps(content))
    return folder
