"""Commitments to the truth: salted labels whose hashes are published before the first diagnosis."""

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from epv_env.common.files import write_bytes, write_json
from identification.bench.session import TrueSignals
from identification.recordings.recording import OUTPUTS
from identification.studies.blind.kinds import NOMINAL, TWO_EFFECTS
from identification.studies.blind.noise_free_gap import (
    NoiseFreeRecording,
    held_out_gap,
    recalibrated_parameters,
)
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.truth import Trial

FORMAT = "epv-blind/2"
LABEL_FILE, RECORDINGS_FILE = "sealed.json", "truth.npz"
MODEL_CHANNELS = ("U", "p1", *OUTPUTS)
"""Channels that a comparison with the model needs."""


def noise_free_recordings(truths: Sequence[TrueSignals]) -> list[NoiseFreeRecording]:
    """The bench's truth, with which the models are compared; without the record at rest."""
    return [
        NoiseFreeRecording(
            name=truth.programme.name,
            held_out=truth.programme.role == "validation",
            period=truth.period,
            channels={name: truth.channels[name] for name in MODEL_CHANNELS},
        )
        for truth in truths
        if truth.programme.role != "quality"
    ]


def explainable_gap(
    trial: Trial, recordings: Sequence[NoiseFreeRecording], settings: BlindSettings = DEFAULTS
) -> dict[str, float]:
    """Noise-free gaps after recalibration [-], by name.

    `recalibrated`: with the four parameters fitted. `explainable`: with all parameters fitted within
    their scatter. The trial's causes leave this gap, and no unit of the nominal design explains it; the
    gap is 1 without a cause.
    """
    gaps = {"recalibrated": _fitted_gap(recordings, with_scatter=False, settings=settings)}
    if trial.kind == NOMINAL:
        return {**gaps, "explainable": 1.0}
    return {**gaps, "explainable": _fitted_gap(recordings, with_scatter=True, settings=settings)}


def truth_label(
    trial: Trial,
    gap: Mapping[str, float],
    single_gaps: Mapping[str, float],
    *,
    recordings: bytes,
    seed: int,
    settings: BlindSettings = DEFAULTS,
) -> dict[str, Any]:
    """The content of sealed.json, JSON-ready.

    Args:
        trial: the truth.
        gap: of `explainable_gap` [-].
        single_gaps: explainable gap of each effect of a pair alone [-].
        recordings: the content of truth.npz.
        seed: of the salt.
        settings: the gap from which a cause is visible.
    """
    salt = np.random.default_rng([seed, trial.number, 0, 5]).bytes(settings.salt_bytes).hex()
    return {
        "format": FORMAT,
        "trial": trial.number,
        "kind": trial.kind,
        "effects": list(trial.causes),
        "visible": _visible_causes(trial, gap, single_gaps, settings.explainable_threshold),
        "struck": list(trial.excluded),
        "sizes": trial.sizes,
        "deviation": trial.form_deviation,
        "other_forms": list(trial.other_forms),
        "warmest_K": trial.winding_temperature_rise,
        "parameters": dict(trial.parameters),
        "gap": dict(gap),
        "gap_alone": dict(single_gaps),
        "truth_sha256": hashlib.sha256(recordings).hexdigest(),
        "salt": salt,
    }


def write_truth(folder: Path, label: Mapping[str, Any], recordings: bytes) -> None:
    """Write the label and the noise-free held-out recordings of one trial."""
    write_bytes(folder / RECORDINGS_FILE, recordings)
    write_json(folder / LABEL_FILE, label, allow_nan=False)


def commitment(folder: Path) -> str:
    """SHA-256 of a trial's label, hexadecimal."""
    return hashlib.sha256((folder / LABEL_FILE).read_bytes()).hexdigest()


def open_commitment(folder: Path, committed: str) -> tuple[dict[str, Any], list[NoiseFreeRecording]]:
    """A label and the noise-free held-out recordings.

    Raises:
        ValueError: the label differs from what `committed` says, or the recordings from what the label
            says.
    """
    if commitment(folder) != committed:
        raise ValueError(
            f"{folder / LABEL_FILE} is not what was committed to before the diagnosis (SHA-256 "
            f"{committed[:12]}..): put the committed file back, or run the trial anew in another folder"
        )
    label = json.loads((folder / LABEL_FILE).read_text(encoding="utf-8"))
    recordings = (folder / RECORDINGS_FILE).read_bytes()
    if hashlib.sha256(recordings).hexdigest() != label["truth_sha256"]:
        raise ValueError(
            f"{folder / RECORDINGS_FILE} is not what its label names: put it back, or run the trial anew"
        )
    return label, unpacked_recordings(recordings)


def packed_recordings(recordings: Sequence[NoiseFreeRecording]) -> bytes:
    """The held-out recordings as the bytes of an npz file."""
    stream = io.BytesIO()
    arrays = {"period": np.array([r.period for r in recordings[:1]])}
    for recording in recordings:
        if recording.held_out:
            arrays |= {f"{recording.name}.{name}": v for name, v in recording.channels.items()}
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def unpacked_recordings(content: bytes) -> list[NoiseFreeRecording]:
    """The recordings that `packed_recordings` packed."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        names = list(dict.fromkeys(key.split(".")[0] for key in arrays if "." in key))
        return [
            NoiseFreeRecording(
                name=name,
                held_out=True,
                period=float(arrays["period"][0]),
                channels={channel: arrays[f"{name}.{channel}"] for channel in MODEL_CHANNELS},
            )
            for name in names
        ]


def _fitted_gap(
    recordings: Sequence[NoiseFreeRecording], *, with_scatter: bool, settings: BlindSettings
) -> float:
    fitted = recalibrated_parameters(recordings, with_scatter=with_scatter, settings=settings)
    return held_out_gap(recordings, dict(fitted), settings)


def _visible_causes(
    trial: Trial, gap: Mapping[str, float], single_gaps: Mapping[str, float], threshold: float
) -> list[str]:
    """Causes that leave a gap above the threshold; both of a pair that only together leave one."""
    if gap["explainable"] < threshold:
        return []
    causes = list(trial.causes)
    if trial.kind != TWO_EFFECTS:
        return causes
    return [effect for effect in causes if single_gaps[effect] >= threshold] or causes
