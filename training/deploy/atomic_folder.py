"""Writing a folder of files whole or not at all."""

import os
import shutil
import tempfile
from pathlib import Path

from training.deploy.quantisation import ExportError


def check_free(folder: Path, names: set[str]) -> None:
    """Raises ExportError if the folder holds anything but files of these names."""
    foreign = sorted({path.name for path in folder.iterdir()} - names) if folder.exists() else []
    if foreign:
        raise ExportError(
            f"{folder} holds {foreign[0]!r}, which no export writes: give --out a new or empty folder"
        )


def write_folder(folder: Path, files: dict[str, bytes]) -> None:
    """Put a folder with these files in place of an earlier one; a failure leaves the earlier one."""
    folder = folder.resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        new, old = Path(temporary, "new"), Path(temporary, "old")
        new.mkdir()
        for name, content in files.items():
            (new / name).write_bytes(content)
        if folder.exists():
            os.rename(folder, old)
        try:
            os.rename(new, folder)
        except BaseException:
            if old.exists():
                shutil.move(old, folder)
            raise
