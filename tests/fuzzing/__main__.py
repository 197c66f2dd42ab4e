"""Counts what becomes of wrong inputs: python -m tests.fuzzing --inputs 1800"""

import argparse
import os
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from types import FrameType

import numpy as np

from tests.fuzzing.command_lines import import_commands, left_files, status_of, wrong_line
from tests.fuzzing.damages import damaged_bytes, damaged_value
from tests.fuzzing.formats import FORMATS, outcome
from tests.fuzzing.option_values import NO_VALUES, number_options, refusal, says

LONGEST = 10
"""Time after which an input counts as a hang [s]."""


GOOD = ("refused", "still good")
"""Outcomes as they should be."""


class Hang(BaseException):
    """An input took longer than LONGEST."""


def outcome_of_file(rng: np.random.Generator, folder: Path) -> tuple[str, str]:
    """What becomes of one spoilt file: outcome, and which format."""
    form = FORMATS[int(rng.integers(len(FORMATS)))]
    form.write(folder)
    good = (folder / form.file).read_bytes()
    damage = damaged_value if form.json and rng.random() < 0.6 else damaged_bytes
    (folder / form.file).write_bytes(damage(good, rng))
    files = sorted(folder.iterdir())
    found = outcome(form, folder)
    return found if sorted(folder.iterdir()) == files else "wrote a file", form.name


def outcome_of_line(rng: np.random.Generator, folder: Path) -> tuple[str, str]:
    """What becomes of one wrong command line: outcome, and the line."""
    name, arguments = wrong_line(rng)
    status = status_of(name, arguments)
    found = "refused" if status == 2 else f"status {status}"
    return "wrote a file" if left_files(folder) else found, f"{name} {arguments}"


def outcome_of_value(rng: np.random.Generator, folder: Path) -> tuple[str, str]:
    """What becomes of one wrong number behind one option: outcome, and the option."""
    options = number_options()
    name, option = options[int(rng.integers(len(options)))]
    value = NO_VALUES[int(rng.integers(len(NO_VALUES)))]
    status, sentence = refusal(name, option, value)
    found = "refused" if status == 2 and says(sentence, option) else f"status {status}: {sentence}"
    return "wrote a file" if left_files(folder) else found, f"{name} {option}={value}"


OUTCOMES = {"file": outcome_of_file, "line": outcome_of_line, "value": outcome_of_value}
"""Kinds of wrong inputs, and what becomes of one."""


def observed(what: str, seed: int) -> tuple[str, str]:
    """Outcome of the input of this seed."""
    rng = np.random.default_rng(seed)
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        signal.alarm(LONGEST)
        try:
            return OUTCOMES[what](rng, Path(name))
        except Hang:
            return "hang", f"{what} {seed}"
        except Exception as error:
            return "traceback", f"{what} {seed}: {type(error).__name__}: {error}"
        finally:
            signal.alarm(0)
            os.chdir(before)


def main() -> int:
    """Command line; returns 1 if an input was not refused as it should be."""
    parser = argparse.ArgumentParser(description="Count what becomes of wrong inputs.")
    parser.add_argument("--inputs", type=int, default=1800, help="files, lines and numbers by turns")
    parser.add_argument("--seed", type=int, default=0, help="of the first input")
    chosen = parser.parse_args()

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise Hang

    signal.signal(signal.SIGALRM, stop)
    import_commands()
    counts: Counter[tuple[str, str]] = Counter()
    slowest = 0.0
    for k in range(chosen.inputs):
        what = list(OUTCOMES)[k % len(OUTCOMES)]
        began = time.perf_counter()
        found, which = observed(what, chosen.seed + k)
        slowest = max(slowest, time.perf_counter() - began)
        counts[what, found] += 1
        if found not in GOOD:
            print(f"{found}: {which}")
    for (what, found), count in sorted(counts.items()):
        print(f"{what:5} {found:20} {count}")
    print(f"the slowest took {slowest:.1f} s")
    return int(any(found not in GOOD for _, found in counts))


if __name__ == "__main__":
    sys.exit(main())
