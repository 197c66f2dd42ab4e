"""Kills long commands at random moments and compares results: python -m tests.killing --kills 20"""

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.killing.studies import ROOT, STUDIES, Study

REFUSED = 2
"""Exit status of a command whose input cannot work: here, that there is nothing to continue."""

TIME_TAKEN = re.compile(rb'"seconds": [0-9.e+-]+')
"""Field of results that a killed run cannot share with an uninterrupted one."""


@dataclass(kw_only=True)
class Outcome:
    """What became of a study."""

    seconds: float
    """Of the uninterrupted run [s]."""
    kills: int = 0
    begun_anew: int = 0
    """Runs that were killed before they had anything to continue."""
    compared: int = 0
    """Runs that ended, after kills, and were compared with the uninterrupted one."""
    faults: int = 0
    """Runs that ended with another result or another status."""


def started(study: Study, folder: Path, out: Path, more: tuple[str, ...]) -> subprocess.Popen:
    """The command in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, *study.arguments, "--out", str(out), *more],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip


def ended(study: Study, folder: Path, out: Path, more: tuple[str, ...]) -> tuple[int, str]:
    """Exit status and last line of errors of a run that nobody kills."""
    process = started(study, folder, out, more)
    errors = process.communicate()[1].decode(errors="replace").strip()
    return process.returncode, errors.rpartition("\n")[2]


def killed(study: Study, folder: Path, out: Path, more: tuple[str, ...], after: float) -> int | None:
    """Kill the command and its workers after a time [s]; its status if it ended before, else None."""
    process = started(study, folder, out, more)
    try:
        process.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None
    return process.returncode


def results(study: Study, out: Path) -> dict[str, bytes]:
    """Content of the result files, less the time that the command took."""
    found = {name: (out / name).read_bytes() for name in study.results}
    return {name: TIME_TAKEN.sub(b"", content) for name, content in found.items()}


def same(study: Study, out: Path, wanted: dict[str, bytes], status: int) -> bool:
    """Whether a run ended well with the wanted results; says what is different."""
    if status:
        print(f"{study.name}: ended with status {status} in {out}", flush=True)
        return False
    other = [name for name, content in results(study, out).items() if content != wanted[name]]
    for name in other:
        print(f"{study.name}: {name} is another one in {out}", flush=True)
    return not other


def outcome(study: Study, kills: int, seed: int, folder: Path) -> Outcome:
    """Kill a study so many times; a run that ends by itself is compared and followed by a new one."""
    rng = np.random.default_rng(seed)
    study.prepare(folder)
    began = time.perf_counter()
    status, errors = ended(study, folder, folder / "whole", ())
    if status:
        raise RuntimeError(f"{study.name} does not even run alone: {errors}")
    found = Outcome(seconds=time.perf_counter() - began)
    wanted = results(study, folder / "whole")
    out, more = folder / "run 0", ()
    while True:
        last = found.kills == kills
        after = float("inf") if last else float(rng.uniform(0.0, found.seconds))
        status = ended(study, folder, out, more)[0] if last else killed(study, folder, out, more, after)
        if status is None:
            found.kills += 1
            more = study.go_on if out.exists() else ()
        elif status == REFUSED and more == study.go_on != ():
            found.begun_anew += 1
            more = study.begin_anew
        else:
            found.compared += 1
            found.faults += not same(study, out, wanted, status)
            out, more = folder / f"run {found.compared}", ()
            if last:
                return found


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns 1 if a killed run gave another result than an uninterrupted one."""
    parser = argparse.ArgumentParser(description="Kill long commands and compare their results.")
    parser.add_argument("--kills", type=int, default=20, help="of each command")
    parser.add_argument("--only", nargs="+", choices=[study.name for study in STUDIES])
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    chosen = parser.parse_args(arguments)
    faults = 0
    for study in STUDIES:
        if chosen.only and study.name not in chosen.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            found = outcome(study, chosen.kills, chosen.seed, Path(folder))
        print(
            f"{study.name}: {found.kills} kills within {found.seconds:.0f} s, {found.begun_anew} begun "
            f"anew, {found.compared} results compared, {found.faults} not the same",
            flush=True,
        )
        faults += found.faults
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
