"""Sealed answers: labels with a salt, whose hashes are given away before anybody diagnoses."""

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from epv_env.common.files import write_bytes, write_text
from identification.bench.measurement import TrueSignals
from identification.recordings.recording import OUTPUTS
from identification.studies.blind.noise_free_gap import NoiseFree, held_out_gap, recalibrated
from identification.studies.blind.truth import NONE, PAIR, Trial

FORMAT = "epv-blind/1"
LABEL, TRUTH = "sealed.json", "truth.npz"
SALT_BYTES = 16

NOTHING_LEFT = 1.02
"""Noise-free gap after recalibration below which nothing is left to explain, and `no_gap` is right."""


def noise_free(truths: Sequence[TrueSignals]) -> list[NoiseFree]:
    """The bench's truth as the models are held against it; a record at rest tells nothing here."""
    return [
        NoiseFree(
            name=truth.programme.name,
            held_out=truth.programme.role == "validation",
            period=truth.period,
            channels={name: truth.channels[name] for name in ("U", "p1", *OUTPUTS)},
        )
        for truth in truths
        if truth.programme.role != "quality"
    ]


def explainable(trial: Trial, recordings: Sequence[NoiseFree]) -> dict[str, float]:
    """Noise-free gap after recalibration: of the four alone, and with the others within their scatter.

    The second is what the trial's effects leave that no unit of the nominal design explains; without
    an effect it is 1.
    """
    found = {"recalibrated": held_out_gap(recordings, _values(recordings, scattered=False))}
    left = 1.0
    if trial.kind != NONE:
        left = held_out_gap(recordings, _values(recordings, scattered=True))
    return {**found, "explainable": left}


def label(
    trial: Trial, gap: Mapping[str, float], own: Mapping[str, float], *, truth: bytes, seed: int
) -> dict[str, Any]:
    """What is sealed, JSON-ready. own: explainable gap of each effect of a pair alone."""
    visible = list(trial.effects) if gap["explainable"] >= NOTHING_LEFT else []
    if trial.kind == PAIR and visible:
        visible = [effect for effect in visible if own[effect] >= NOTHING_LEFT] or visible
    salt = np.random.default_rng([seed, trial.number, 0, 5]).bytes(SALT_BYTES).hex()
    return {
        "format": FORMAT,
        "trial": trial.number,
        "kind": trial.kind,
        "effects": list(trial.effects),
        "visible": visible,
        "struck": list(trial.struck),
        "sizes": trial.sizes,
        "deviation": trial.deviation,
        "warmest_K": trial.warmest,
        "parameters": dict(trial.parameters),
        "gap": dict(gap),
        "gap_alone": dict(own),
        "truth_sha256": hashlib.sha256(truth).hexdigest(),
        "salt": salt,
    }


def write_sealed(folder: Path, content: Mapping[str, Any], truth: bytes) -> None:
    """Write the label and the noise-free held-out recordings of one trial."""
    write_bytes(folder / TRUTH, truth)
    write_text(folder / LABEL, json.dumps(content, indent=1, allow_nan=False) + "\n")


def commitment(folder: Path) -> str:
    """SHA-256 of a trial's label."""
    return hashlib.sha256((folder / LABEL).read_bytes()).hexdigest()


def opened(folder: Path, committed: str) -> tuple[dict[str, Any], list[NoiseFree]]:
    """A label and the noise-free held-out recordings. Raises ValueError if either was changed."""
    if commitment(folder) != committed:
        raise ValueError(
            f"{folder / LABEL} is not what was committed to before the diagnosis (SHA-256 "
            f"{committed[:12]}..): put the sealed file back, or run the trial anew in another folder"
        )
    content = json.loads((folder / LABEL).read_text(encoding="utf-8"))
    truth = (folder / TRUTH).read_bytes()
    if hashlib.sha256(truth).hexdigest() != content["truth_sha256"]:
        raise ValueError(
            f"{folder / TRUTH} is not what its label names: put it back, or run the trial anew"
        )
    return content, unpacked(truth)


def packed(recordings: Sequence[NoiseFree]) -> bytes:
    """The held-out recordings as the bytes of an npz file."""
    stream = io.BytesIO()
    arrays = {"period": np.array([r.period for r in recordings[:1]])}
    for recording in recordings:
        if recording.held_out:
            arrays |= {f"{recording.name}.{name}": v for name, v in recording.channels.items()}
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def unpacked(content: bytes) -> list[NoiseFree]:
    """What `packed` packed."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        names = list(dict.fromkeys(key.split(".")[0] for key in arrays if "." in key))
        return [
            NoiseFree(
                name=name,
                held_out=True,
                period=float(arrays["period"][0]),
                channels={channel: arrays[f"{name}.{channel}"] for channel in ("U", "p1", *OUTPUTS)},
            )
            for name in names
        ]


def _values(recordings: Sequence[NoiseFree], *, scattered: bool) -> dict[str, float]:
    return dict(recalibrated(recordings, scattered=scattered))
