"""Stubs of diagnoses; other processes import them from this module."""

import json
from pathlib import Path

from epv_env.common.files import write_text

NO_GAP = {
    "format": "epv-gap/3", "verdict": "no_gap", "where": {"component": {}}, "causes": [],
    "ambiguity_set": [], "inclusion": {}, "seconds": 0.5,
}  # fmt: skip


def says_no_gap(campaign: Path, out: Path, *, without=(), report=False) -> None:
    """Finds nothing, and leaves a note of what it was told."""
    seen = {"campaign": sorted(path.name for path in campaign.iterdir()), "without": list(without)}
    write_text(out / "seen.json", json.dumps(seen))
    write_text(out / "gap.json", json.dumps(NO_GAP))


def fails(campaign: Path, out: Path, *, without=(), report=False) -> None:
    """Does not get through."""
    raise RuntimeError("it did not converge")
