"""Pairing the working tree with an earlier commit: both in processes of their own, run by turns."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

from tests.benchmarks.interfaces import INTERFACES
from tests.benchmarks.measure import Table

ROOT = Path(__file__).parents[2]


def compare(table: Table, commit: str, quick: bool) -> None:
    """Rates of each interface here and at the commit, and the ratio of their medians.

    Raises SystemExit where the commit is not known.
    """
    repetitions, share = (3, 0.1) if quick else (15, 1.0)
    with checked_out(commit) as other, measuring(ROOT) as new, measuring(other) as old:
        table.section(f"control periods per second, by turns; ratio: to {commit}")
        for name in INTERFACES:
            rates = [(asked(new, name, share), asked(old, name, share)) for _ in range(repetitions)]
            now, before = ([rate for rate in column if rate] for column in zip(*rates, strict=True))
            if now and before:
                table.add(name, "1/s", now, ratio=median(now) / median(before))
            else:
                print(f"  {name}: {'this tree' if before else commit} lacks it")


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """A temporary work tree of the commit."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        made = _git("worktree", "add", "--detach", str(tree), commit)
        if made.returncode:
            raise SystemExit(
                f"commit {commit!r} cannot be checked out ({made.stderr.strip().splitlines()[-1]}): "
                "give a commit of this repository"
            )
        try:
            yield tree
        finally:
            _git("worktree", "remove", "--force", str(tree))


def _git(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)


@contextmanager
def measuring(tree: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that measures the tree's interfaces; -P: it imports from the tree alone."""
    process = subprocess.Popen(
        [sys.executable, "-P", str(Path(__file__).with_name("interfaces.py"))],
        cwd=tree, env={**os.environ, "PYTHONPATH": str(tree)}, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def asked(process: subprocess.Popen[str], name: str, share: float) -> float | None:
    """The rate of one run of an interface; None if the process's tree lacks it."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(json.dumps([name, share]) + "\n")
    process.stdin.flush()
    answer = process.stdout.readline()
    if not answer:
        raise SystemExit(f"the process that measures {name!r} ended: see its error above")
    return json.loads(answer).get("rate")
