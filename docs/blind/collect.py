"""Add the answers of a round to the archive, and write the round's table.

    python -m docs.blind.collect round-5 FOLDER    # a folder of NAME.json, or of NAME/gap.json

What the archive held of this round is replaced.
"""

import argparse
import csv
import hashlib
import io
import json
import sys
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from docs.studies.common import PAGE, fill
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import write_bytes, write_text

FOLDER = Path(__file__).parent
ARCHIVE = "answers.tar.xz"
"""Of every answer, as ROUND/NAME.json."""
COLUMNS = ("case", "verdict", "causes", "P", "nominal", "recalibrated", "with cause", "seconds")
"""Causes: the two most probable ones, with their probabilities. Gaps in deviations of the noise."""


def answers_in(folder: Path) -> dict[str, bytes]:
    """Answers by case. Raises ValueError for a folder without one."""
    found = {path.parent.name: path for path in folder.glob("*/gap.json")}
    found = found or {path.stem: path for path in folder.glob("*.json")}
    if not found:
        raise ValueError(f"{folder} holds no answer: give a folder of NAME.json or NAME/gap.json")
    return {name: path.read_bytes() for name, path in found.items()}


def unpacked(archive: bytes) -> dict[str, bytes]:
    """Files of an archive by name."""
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        return {each.name: tar.extractfile(each).read() for each in tar}  # type: ignore[union-attr]


def packed(files: Mapping[str, bytes]) -> bytes:
    """An archive that depends on names and contents alone."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:xz", format=tarfile.USTAR_FORMAT) as tar:
        for name, content in sorted(files.items()):
            entry = tarfile.TarInfo(name)  # of the year 1970, and nobody's
            entry.size = len(content)
            tar.addfile(entry, io.BytesIO(content))
    return stream.getvalue()


def table(files: Mapping[str, bytes], name: str) -> str:
    """The answers of a round as CSV. files: of the archive."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for path, content in sorted(files.items()):
        if path.startswith(f"{name}/"):
            writer.writerow(row(Path(path).stem, json.loads(content)))
    return stream.getvalue()


def row(case: str, answer: Mapping) -> list[str]:
    """COLUMNS of one gap.json."""
    first = answer["causes"][:2]
    gaps = [f"{answer['gap'][key]:.3g}" for key in ("nominal", "recalibrated", "with_cause")]
    return [
        case, answer["verdict"], "; ".join(" + ".join(cause["effects"]) for cause in first),
        "; ".join(f"{cause['probability']:.2g}" for cause in first), *gaps, f"{answer['seconds']:.0f}",
    ]  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Write archive, table, and the archive's digest into the page; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("round", help="such as round-5")
    parser.add_argument("answers", type=Path, help="folder of NAME.json, or of NAME/gap.json")
    options = parser.parse_args(arguments)
    added = {f"{options.round}/{k}.json": answer for k, answer in answers_in(options.answers).items()}
    path = FOLDER / ARCHIVE
    kept = unpacked(path.read_bytes()) if path.exists() else {}
    kept = {name: content for name, content in kept.items() if not name.startswith(f"{options.round}/")}
    archive = packed(kept | added)
    write_text(FOLDER / f"{options.round}.csv", table(added, options.round))
    write_bytes(path, archive)
    fill(FOLDER / PAGE, {"digest": f"`{hashlib.sha256(archive).hexdigest()}`"})
    print(f"{len(added)} answers of {options.round} in {path}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
