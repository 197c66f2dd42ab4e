"""A folder of results: its options, its only writer, and how far the work on it is."""

import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from filelock import FileLock, Timeout

from epv_env.common.files import checked, decoded, remove_leftovers, write_json

Shape = TypeVar("Shape")

CONFIG = "config.json"


def check_options(folder: Path, options: Mapping[str, Any], what: str) -> None:
    """Check that a folder, if it was begun, was begun with these options.

    Args:
        folder: of the results.
        options: all that the results depend on, as JSON gives it back.
        what: the results, in a word.

    Raises:
        ValueError: the folder was begun with other options, or its configuration cannot be read.
    """
    earlier = read_config(folder, dict[str, Any])
    if earlier is not None:
        check_same(earlier, options, f"{folder} holds a {what} with", "go on with the same")


def check_same(
    earlier: Mapping[str, Any], options: Mapping[str, Any], subject: str, remedy: str
) -> None:
    """Raises ValueError if an earlier run had another value of one of these options.

    subject, remedy: begin and end the sentence, as in "runs/a holds a sweep with" (seed 0, not 1) and
    "go on with the same".
    """
    for name, value in options.items():
        if earlier.get(name) != value:
            raise ValueError(
                f"{subject} {name} {earlier.get(name)}, not {value}: {remedy}, or choose another --out"
            )


def read_config(folder: Path, shape: type[Shape]) -> Shape | None:
    """The configuration in a folder as a `shape`, None if there is none.

    Raises JSONFileError if it is damaged or of another shape.
    """
    path = folder / CONFIG
    if not path.exists():
        return None
    remedy = "remove the folder, or choose another --out"
    return checked(decoded(path, remedy=remedy), shape, where=str(path), remedy=remedy)


def write_options(folder: Path, options: Mapping[str, Any]) -> None:
    """Write down what the folder's results depend on."""
    write_json(folder / CONFIG, options)


LOCK_FILE = ".lock"
"""Within a folder that a process writes; the operating system frees it when the process ends."""


@contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Hold a folder of results alone; it is made if it is missing, and removed again if it stays empty.

    What killed writers left is removed first.

    Raises ValueError if another process writes into the folder.
    """
    made = [level for level in (folder, *folder.parents) if not level.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LOCK_FILE
    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise ValueError(
            f"another process writes into {folder}: wait until it ends, or choose another --out"
        ) from None
    try:
        remove_leftovers(folder)
        yield
    finally:
        # Removed while it is held: whoever opened it meanwhile sees that it has no name and tries again.
        with suppress(OSError):
            path.unlink()
        lock.release()
        with suppress(OSError):
            for level in made:
                level.rmdir()  # as long as they are empty


Item = TypeVar("Item")


def progress(items: Iterable[Item], *, what: str, total: int | None = None) -> Iterator[Item]:
    """Yield the items and show a bar; where no terminal reads it, a line every ten seconds."""
    from tqdm import tqdm

    interval = 0.2 if sys.stderr.isatty() else 10.0
    yield from tqdm(items, desc=what, total=total, file=sys.stderr, mininterval=interval)
