"""Checks of channels and runs: what was measured can be compared with a model."""

from collections.abc import Iterator
from math import isfinite

import numpy as np

from identification.gap.model.grey_box import GreyBox
from identification.gap.model.names import repeated
from identification.gap.model.recorded_run import Channel, Run
from identification.gap.model.settings import PreparationSettings

FEWEST_SAMPLES = "a run needs three samples or more: record longer, or leave the run out"


def recording_findings(plant: GreyBox, settings: PreparationSettings) -> Iterator[str]:
    """Sentences on what is wrong with the channels and the runs of a plant."""
    if not plant.channels:
        yield "channels: there is none, but a gap is seen in measured outputs: give one or more"
    for name in repeated(channel.name for channel in plant.channels):
        yield f"channels: two are named {name}, but results are listed by name: rename one"
    for channel in plant.channels:
        yield from _channel_findings(channel)
    yield from _role_findings(plant)
    for run in plant.runs:
        yield from _run_findings(plant, run, settings)


def _channel_findings(channel: Channel) -> Iterator[str]:
    member = f"channels, {channel.name}"
    if channel.noise is not None and not (isfinite(channel.noise) and channel.noise > 0):
        yield (
            f"{member}: noise {channel.noise:g} is not positive, but residuals are divided by it: where "
            "it "
            "is not known, leave it out (None)"
        )
    if not (isfinite(channel.resolution) and channel.resolution >= 0):
        yield (
            f"{member}: resolution {channel.resolution:g} is no step: give a positive one, or 0 for none"
        )
    if not (isfinite(channel.scale) and channel.scale > 0):
        yield f"{member}: scale {channel.scale:g} is not positive: give the size of the unit in SI"


def _role_findings(plant: GreyBox) -> Iterator[str]:
    held_out = [run for run in plant.runs if run.held_out]
    fitted = [run for run in plant.runs if not run.held_out]
    if not plant.runs:
        yield "runs: there is none: give two or more, one of them with held_out=True"
        return
    if not held_out:
        yield (
            "runs: no run is held out, but a gap is judged on recordings never fitted to: set "
            "held_out=True in at least one"
        )
    if not fitted:
        yield (
            "runs: all runs are held out, but parameters are fitted to the others: set held_out=False "
            "in "
            "at least one"
        )
    for kind, runs in (("held-out", held_out), ("fitted", fitted)):
        if runs and not any(np.any(run.trusted) for run in runs):
            yield f"runs: no reading of a {kind} run is trusted: set `trusted` where readings count"


def _run_findings(plant: GreyBox, run: Run, settings: PreparationSettings) -> Iterator[str]:
    member, samples = f"run {run.name}", len(run.time)
    if np.ndim(run.time) != 1 or samples < 3:
        yield f"{member}: time has the shape {np.shape(run.time)}: {FEWEST_SAMPLES}"
        return
    yield from _time_findings(member, run, settings)
    expected = len(plant.channels), samples
    for name, array in (("measured", run.measured), ("trusted", run.trusted)):
        if np.shape(array) != expected:
            yield (
                f"{member}: {name} has the shape {np.shape(array)}, not (channels, samples) = "
                f"{expected}: "
                "give a row for each channel"
            )
    if np.shape(run.measured) == np.shape(run.trusted) == expected:
        yield from _reading_findings(plant, member, run)
    for name, signal in run.inputs.items():
        if np.shape(signal) != (samples,):
            yield (
                f"{member}: input {name} has the shape {np.shape(signal)}, not (samples,) = "
                f"({samples},): "
                "give a value for each sample"
            )
        elif not np.all(np.isfinite(signal)):
            first = int(np.argmin(np.isfinite(signal)))
            yield (
                f"{member}: input {name} is not finite at sample {first}: fill the gap or cut the run "
                "there"
            )


def _time_findings(member: str, run: Run, settings: PreparationSettings) -> Iterator[str]:
    last = len(run.time) - 1
    if not np.all(np.diff(run.time) > 0):
        first = int(np.argmin(np.diff(run.time) > 0))
        yield f"{member}: time does not rise from sample {first} to {first + 1}: sort or cut the run"
        return
    uniform = np.linspace(run.time[0], run.time[-1], last + 1)
    period = (run.time[-1] - run.time[0]) / last
    late = np.abs(run.time - uniform) > settings.uneven_period * period
    if np.any(late):
        yield (
            f"{member}: time is not uniform: sample {int(np.argmax(late))} is off the period of "
            f"{period:.6g} s: "
            "resample the run, or let samples that a channel lacks be untrusted"
        )


def _reading_findings(plant: GreyBox, member: str, run: Run) -> Iterator[str]:
    if np.asarray(run.trusted).dtype != bool:
        yield f"{member}: trusted is no boolean array: convert it with astype(bool)"
        return
    for channel, readings, trusted in zip(plant.channels, run.measured, run.trusted, strict=True):
        wrong = trusted & ~np.isfinite(readings)
        if np.any(wrong):
            yield (
                f"{member}: channel {channel.name} is not finite at sample {int(np.argmax(wrong))}, but "
                "trusted there: set trusted to False where a reading is missing"
            )
