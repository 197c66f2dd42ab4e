"""Checks of the simulator: shapes, finite outputs, and candidates that do not touch each other."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.model.plant_error import PlantError
from identification.gap.model.settings import PreparationSettings
from identification.gap.model.trial_effects import magnitudes, side_by_side, trials


def simulation_findings(plant: GreyBox, settings: PreparationSettings) -> list[str]:
    """Sentences on what is wrong with what a plant simulates.

    Args:
        plant: a plant whose recordings and parameters are in order.
        settings: limits of the checks.

    Raises:
        PlantError: the simulator raises an error of its own.
    """
    alone = _outputs(plant, [{}])
    found = _shape_findings(plant, alone, 1) or _finite_findings(plant, alone)
    if found:
        return found
    beside = _outputs(plant, [{}, trials(plant, settings)[0].values])
    found = _shape_findings(plant, beside, 2) or _mixing_findings(plant, alone, beside, settings)
    if found:
        return found
    shortest = min(range(len(plant.runs)), key=lambda r: len(plant.runs[r].time))
    return [*_trace_findings(plant, shortest), *_forcing_findings(plant, shortest, settings)]


def _outputs(plant: GreyBox, changes: Sequence[Mapping[str, float]]) -> list[NDArray]:
    """Outputs of all runs for candidates that differ from the nominal one."""
    try:
        values = side_by_side(plant, changes, all_symbols=len(changes) > 1)
        return plant.outputs(values, list(range(len(plant.runs))))
    except Exception as error:
        raise PlantError(
            f"outputs: {len(changes)} candidates side by side end in {type(error).__name__}: {error}: "
            "every "
            f"value is an array ({len(changes)},), and a symbol that is left out has its nominal value"
        ) from error


def _shape_findings(plant: GreyBox, outputs: Sequence[NDArray], n: int) -> list[str]:
    if len(outputs) != len(plant.runs):
        return [
            f"outputs: it returns {len(outputs)} arrays for {len(plant.runs)} runs: return one for each"
        ]
    expected = [(len(plant.channels), len(run.time), n) for run in plant.runs]
    return [
        f"outputs: run {run.name} has the shape {np.shape(output)}, not (channels, samples, n) = "
        f"{shape}: "
        "return that shape for n candidates"
        for run, output, shape in zip(plant.runs, outputs, expected, strict=True)
        if np.shape(output) != shape
    ]


def _finite_findings(plant: GreyBox, outputs: Sequence[NDArray]) -> list[str]:
    found = []
    for run, output in zip(plant.runs, outputs, strict=True):
        wrong = run.trusted & ~np.isfinite(output[..., 0])
        if np.any(wrong):
            channel, sample = np.argwhere(wrong)[0]
            found.append(
                f"outputs: run {run.name}, channel {plant.channels[channel].name} is not finite at "
                "sample "
                f"{sample} at the nominal values: correct the model or the values, or leave the run out"
            )
    return found


def _mixing_findings(
    plant: GreyBox,
    alone: Sequence[NDArray],
    beside: Sequence[NDArray],
    settings: PreparationSettings,
) -> list[str]:
    """Runs in which the nominal candidate depends on the one beside it."""
    found = []
    for run, one, two in zip(plant.runs, alone, beside, strict=True):
        error = np.abs(two[..., 0] - one[..., 0]) / magnitudes(one)[:, None]
        if np.any(run.trusted & ~(error <= settings.side_by_side_error)):
            found.append(
                f"outputs: run {run.name} of the nominal candidate changes when another candidate is "
                "simulated beside it, or a cause is given its nominal value: keep candidates apart "
                "along "
                "the last axis, and let no cause act at its nominal value"
            )
    return found


def _trace_findings(plant: GreyBox, run: int) -> list[str]:
    """What is wrong with states and regimes of a run."""
    values, name = side_by_side(plant, [{}]), plant.runs[run].name
    expected = np.shape(plant.runs[run].time)
    found = [
        f"states: {state} of run {name} has the shape {np.shape(trace.values)}, not (samples,) = "
        f"{expected}: "
        "return a value for each sample"
        for state, trace in plant.states(values, run).items()
        if np.shape(trace.values) != expected
    ]
    for regime, mask in plant.regimes(values, run).items():
        if np.shape(mask) != expected or np.asarray(mask).dtype != bool:
            found.append(
                f"regimes: {regime} of run {name} is {np.asarray(mask).dtype} {np.shape(mask)}, not "
                "boolean "
                f"(samples,) = {expected}: return True where the regime holds"
            )
    return found


def _forcing_findings(plant: GreyBox, run: int, settings: PreparationSettings) -> list[str]:
    """What is wrong with the outputs under a forcing of each equation."""
    values, samples = side_by_side(plant, [{}]), len(plant.runs[run].time)
    edges = np.unique(np.linspace(0, samples - 1, settings.trial_windows + 1).astype(int))
    expected = len(plant.channels), samples, len(edges) - 1
    shapes = {
        equation.name: np.shape(plant.forced(values, equation, run, edges))
        for equation in plant.equations
        if equation.step
    }
    return [
        f"forced: equation {name} has the shape {shape}, not (channels, samples, windows) = {expected}: "
        "return the change of the outputs for each window"
        for name, shape in shapes.items()
        if shape != expected
    ]
