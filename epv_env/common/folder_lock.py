"""One process for each folder or file of results: a second one is refused, not interleaved."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

LOCK_FILE = ".lock"
"""Within a folder that a process writes; the operating system frees it when the process ends."""


@contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Hold a folder of results alone; it is made if it is missing, and removed again if it stays empty.

    Raises ValueError if another process writes into the folder.
    """
    made = _missing_parents(folder)
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
        yield
    finally:
        # Removed while it is held: whoever opened it meanwhile sees that it has no name and tries again.
        with suppress(OSError):
            path.unlink()
        lock.release()
        _remove_empty(made)


def _missing_parents(folder: Path) -> list[Path]:
    """The folder and those above it that do not exist yet, the innermost first."""
    return [each for each in (folder, *folder.parents) if not each.exists()]


def _remove_empty(folders: list[Path]) -> None:
    """Remove folders that hold nothing, the innermost first."""
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            return
