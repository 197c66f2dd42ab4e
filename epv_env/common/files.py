"""Writing files whole or not at all."""

import errno
import os
import stat
import tempfile
from pathlib import Path


def read_bytes(path: Path) -> bytes:
    """The content of a regular file. Raises OSError, also for a pipe or a device, which could block."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "no regular file", str(path))
    return path.read_bytes()


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically: a reader finds the old content or the new, never a part."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """`write_text` for bytes. Raises OSError with the path, also where the disk is full."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        os.unlink(temporary)
        raise OSError(error.errno, f"cannot write: {error.strerror or error}", str(path)) from None
    except BaseException:
        os.unlink(temporary)
        raise
