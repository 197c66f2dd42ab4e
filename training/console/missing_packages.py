"""Imported first by every script of this folder: a missing package is named with its extra.

Their imports fail before `main` is called, so `fail_clearly` cannot say it. `epv` says it for itself.
"""

import sys
from pathlib import Path
from types import TracebackType

from epv_env.common.extras import missing_package


def _say(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print a missing package of an extra as a sentence, anything else as Python does."""
    missing = error.name if isinstance(error, ModuleNotFoundError) else None
    sentence = missing_package(missing or "", preferred="training")
    if sentence is None:
        sys.__excepthook__(kind, error, trace)
    else:
        print(f"error: {sentence}", file=sys.stderr)


def _is_script() -> bool:
    """Whether a file of `training` runs as a program, not another program that imports one."""
    file = getattr(sys.modules["__main__"], "__file__", None)
    return file is not None and Path(file).resolve().parent == Path(__file__).resolve().parents[1]


if _is_script():
    sys.excepthook = _say
