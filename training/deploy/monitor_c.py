"""The C files of a monitor: the same decisions as controllers.monitor, in double precision."""

import tempfile
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from controllers import monitor
from controllers.monitor import CONDITIONS, FEATURES, Monitor, MonitorModel
from training.deploy.c_code import TEMPLATES
from training.deploy.compiled import build

FILES = ("epv_monitor.h", "epv_monitor.c")
"""What an export consists of."""
CONSTANTS = {
    name.lower(): getattr(monitor, name)
    for name in (
        "BEFORE", "AFTER", "SHORTEST", "LONGEST", "REST", "FLAT", "RISE", "SHUT", "CLIPPED", "MEMORY",
        "BEFORE_START", "QUADRATIC", "LINEAR", "LEAST", "SETTLING", "RELEARNT",
    )
}  # fmt: skip


def sources(model: MonitorModel) -> dict[str, str]:
    """The files by name."""
    shifts, weights, later, names = Monitor(model).hypotheses()
    effects = effects_of(model)
    arrays = {
        "centre": model.centre, "scale": model.scale, "whiten": model.whiten,
        "expected": model.expected, "offset": model.offset, "shifts": shifts, "weights": weights,
        "later": later, "kinks": np.array(monitor.KINKS),
        "effect": np.array([effects.index(name) for name in names]),
    }  # fmt: skip
    numbers = {
        "conditions": len(CONDITIONS), "kink_count": len(monitor.KINKS),
        "terms": model.expected.shape[1], "features": len(FEATURES),
        "count": len(names), "causes": len(effects), "period": Monitor.period,
        "rows": monitor.BEFORE + monitor.LONGEST + monitor.AFTER,
    }  # fmt: skip
    values = {name: braced(array.tolist()) for name, array in arrays.items()}
    texts = {name: repr(value) for name, value in (CONSTANTS | numbers).items()}
    template = {name: Template((TEMPLATES / name).read_text(encoding="utf-8")) for name in FILES}
    return {name: each.substitute(texts | values) for name, each in template.items()}


def compiled_sources(model: MonitorModel, compiler: list[str]) -> dict[str, str]:
    """The files by name, once this compiler takes them. Raises ExportError."""
    files = sources(model)
    with tempfile.TemporaryDirectory() as temporary:
        for name, text in files.items():
            Path(temporary, name).write_text(text, encoding="utf-8")
        build(compiler, Path(temporary), "-c", "epv_monitor.c", output="epv_monitor.o")
    return files


def effects_of(model: MonitorModel) -> list[str]:
    """Names of the effects in the order of the C code, then "unknown" and "return"; no part of it."""
    return list(dict.fromkeys(Monitor(model).hypotheses()[3]))


def braced(value: Any) -> str:
    """A nested list as a C initialiser."""
    return "{" + ", ".join(map(braced, value)) + "}" if isinstance(value, list) else repr(value)
