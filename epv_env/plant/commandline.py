"""What the command lines share: checked paths, and errors as one sentence."""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path


def fail_clearly(main: Callable[[], int]) -> int:
    """Run a command; a ValueError or OSError becomes one sentence on stderr and exit status 2."""
    try:
        return main()
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted: what was finished is kept", file=sys.stderr)
        return 130


def writable_file(text: str) -> Path:
    """A path whose folder can be written, for argparse."""
    path = Path(text)
    writable_folder(str(path.parent))
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder: give the name of a file")
    return path


def writable_folder(text: str) -> Path:
    """A path at which a folder exists or can be made and written, for argparse."""
    path = Path(text)
    existing = path.absolute()
    while not existing.exists():
        existing = existing.parent
    if not existing.is_dir():
        raise argparse.ArgumentTypeError(f"{existing} is not a folder: choose another path")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise argparse.ArgumentTypeError(f"{existing} cannot be written: choose another path")
    return path
