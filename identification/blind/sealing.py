"""The sealed truth of a trial: a salted label whose hash is published before the first diagnosis."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from epv_env.common.files import write_text
from identification.blind.truth import TWO_EFFECTS, Trial

FORMAT = "epv-blind/3"
LABEL_FILE, COMMITMENTS_FILE = "sealed.json", "commitments.sha256"

SALT_BYTES = 16
"""Length of the salt in a label [bytes]: its hash tells nothing of the content."""

EXPLAINABLE_THRESHOLD = 1.02
"""Noise-free gap after recalibration below which nothing is left to explain [-]; `no_gap` is then the
correct verdict."""


def trial_folder(out: Path, number: int) -> Path:
    """Folder of a trial."""
    return out / "trials" / f"{number:04d}"


def truth_label(
    trial: Trial, gap: float, single_gaps: Mapping[str, float], *, seed: int
) -> dict[str, Any]:
    """The content of sealed.json, JSON-ready.

    Args:
        trial: the truth.
        gap: of `explainable_gap` [-].
        single_gaps: explainable gap of each effect of a pair alone [-].
        seed: of the salt.
    """
    salt = np.random.default_rng([seed, trial.number, 0, 5]).bytes(SALT_BYTES).hex()
    return {
        "format": FORMAT,
        "trial": trial.number,
        "kind": trial.kind,
        "effects": list(trial.causes),
        "visible": _visible_causes(trial, gap, single_gaps),
        "struck": list(trial.excluded),
        "sizes": trial.sizes,
        "deviation": trial.form_deviation,
        "other_forms": list(trial.other_forms),
        "warmest_K": trial.winding_temperature_rise,
        "parameters": dict(trial.parameters),
        "gap": {"explainable": gap},
        "gap_alone": dict(single_gaps),
        "salt": salt,
    }


def commit(out: Path, trials: int) -> dict[int, str]:
    """Hash every label, write and print the hashes, and return them by trial.

    Raises:
        ValueError: a label has changed since an earlier commitment.
    """
    path = out / COMMITMENTS_FILE
    earlier = read_commitments(out)
    hashes = {number: _hash(trial_folder(out, number)) for number in range(trials)}
    for number, digest in hashes.items():
        if earlier.get(number, digest) != digest:
            raise ValueError(
                f"{trial_folder(out, number) / LABEL_FILE} is not what {path} commits to: put the "
                "committed file back, or start in another folder"
            )
    text = "".join(f"{digest}  {n:04d}\n" for n, digest in sorted({**earlier, **hashes}.items()))
    write_text(path, text)
    print(f"{text}committed: {path}", flush=True)
    return hashes


def read_commitments(out: Path) -> dict[int, str]:
    """Hashes by trial; none where there is no file."""
    path = out / COMMITMENTS_FILE
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    pairs = [line.split() for line in lines]
    return {int(number): digest for digest, number in pairs}


def open_label(folder: Path, committed: str) -> dict[str, Any]:
    """A label, opened. Raises ValueError if it differs from what `committed`, its hash, says."""
    if _hash(folder) != committed:
        raise ValueError(
            f"{folder / LABEL_FILE} is not what was committed to before the diagnosis (SHA-256 "
            f"{committed[:12]}..): put the committed file back, or run the trial anew in another folder"
        )
    return json.loads((folder / LABEL_FILE).read_text(encoding="utf-8"))


def _hash(folder: Path) -> str:
    """SHA-256 of a trial's label, hexadecimal."""
    return hashlib.sha256((folder / LABEL_FILE).read_bytes()).hexdigest()


def _visible_causes(trial: Trial, gap: float, single_gaps: Mapping[str, float]) -> list[str]:
    """Causes that leave a gap above the threshold; both of a pair that only together leave one."""
    if gap < EXPLAINABLE_THRESHOLD:
        return []
    causes = list(trial.causes)
    if trial.kind != TWO_EFFECTS:
        return causes
    return [effect for effect in causes if single_gaps[effect] >= EXPLAINABLE_THRESHOLD] or causes
