"""Measurements of an export before it is written: agreement, closed loop, time for a decision."""

import csv
import ctypes
import platform
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.learned import LearnedPolicy
from training.deploy.compiled_export import CODE, VARIANT_NAMES, CompiledPolicy, build, float_logits
from training.deploy.double_precision import in_double, logits_along
from training.deploy.quantisation import ExportError
from training.deploy.visited_states import PLANTS, SCENARIO, VisitedStates
from training.evaluation.rollout import run_episodes


def margins(policy: LearnedPolicy, states: VisitedStates) -> NDArray:
    """Logit of on minus logit of off (episodes, periods), in the policy's precision along the states."""
    return _difference(logits_along(policy, states.observations))


def _difference(logits: NDArray) -> NDArray:
    """Logit of on minus that of off (...) in double precision, from logits (..., 2)."""
    return logits[..., 1].astype(np.float64) - logits[..., 0]


def agreement(policy: LearnedPolicy, code: ctypes.CDLL, states: VisitedStates) -> dict[str, Any]:
    """How the float code's decisions compare with the policy's, and how near any of them was to a tie.

    Raises ExportError if they differ on any state.
    """
    logits = float_logits(code, states.observations, cells=policy.cells)
    differs = (logits[..., 0] < logits[..., 1]) != states.actions
    exact = margins(in_double(policy), states)
    if np.any(differs):
        worst = np.abs(exact[differs]).max()
        raise ExportError(
            f"the C code decides otherwise than the policy on {differs.sum()} of {exact.size} states, "
            f"where the logits are up to {worst:.2g} apart: below 1e-4 that is rounding at a tie, train "
            "a little longer; above it the code is wrong"
        )
    rounding_c = np.abs(_difference(logits) - exact).max()
    rounding_python = np.abs(margins(policy, states) - exact).max()
    return {
        "states": exact.size,
        "float_agrees": int(np.sum(~differs)),
        "least_margin": float(np.abs(exact).min()),
        "rounding_of_c": float(rounding_c),
        "rounding_of_python": float(rounding_python),
        "states_within_rounding": int(np.sum(np.abs(exact) <= rounding_c + rounding_python)),
    }


def follow(controller: Controller, states: VisitedStates) -> NDArray:
    """Decisions (episodes, periods) of a controller along the states that another one visited."""
    controller.reset(len(states.observations))
    periods = range(states.observations.shape[1])
    return np.stack([controller.act(states.observations[:, k]) for k in periods], axis=1)


def closed_loop(
    policy: LearnedPolicy,
    code: ctypes.CDLL,
    *,
    seeds: list[int],
    duration: float,
    progress: Callable[[float], None],
) -> dict[str, dict[str, float]]:
    """Figures of the policy and of each compiled variant on the same episodes, by controller's name."""
    compiled = (CompiledPolicy(code=code, variant=name, cells=policy.cells) for name in VARIANT_NAMES)
    contenders = [policy, *compiled]
    figures = {}
    for k, controller in enumerate(contenders):
        metrics, _ = run_episodes(
            controller,
            seeds=seeds,
            duration=duration,
            options={"scenario": SCENARIO, "parameters": PLANTS},
            progress=lambda share, before=k: progress((before + share) / len(contenders)),
        )
        figures[controller.name] = {
            "C1_stayed": float(metrics.stayed.mean()),
            "C1_worst_excursion_bar": float(metrics.excursion_bar.max()),
            "C2_largest_breakdown_bar": float(metrics.breakdown_bar.max()),
            "rms_error_bar": float(np.sqrt(np.mean(metrics.rms_bar**2))),
            "switchings_per_s": float(metrics.switchings_per_s.mean()),
        }
    return figures


def run_parity(compiler: list[str], folder: Path) -> str:
    """Compile and run parity.c in the folder; what it printed. Raises ExportError if it fails."""
    program = build(compiler, folder, "parity.c", *CODE, output="parity")
    done = subprocess.run([program], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ExportError(f"the parity test failed: {' '.join((done.stdout + done.stderr).split())}")
    return done.stdout


def run_bench(compiler: list[str], folder: Path) -> dict[str, dict[str, float]]:
    """Compile and run bench.c in the folder: microseconds for a decision by variant."""
    program = build(compiler, folder, "bench.c", *CODE, output="bench")
    done = subprocess.run([program], cwd=folder, capture_output=True, text=True, check=True)
    rows = csv.DictReader(done.stdout.splitlines())
    return {row.pop("variant"): {name: float(value) for name, value in row.items()} for row in rows}


def machine(compiler: list[str]) -> dict[str, str]:
    """Processor, system and compiler of the measured times."""
    done = subprocess.run([*compiler, "--version"], capture_output=True, text=True, check=False)
    version = (done.stdout.splitlines() or ["unknown"])[0]
    return {"processor": platform.machine(), "system": platform.system(), "compiler": version}
