"""Pictures without a display: writing one, and the words in them."""

import io
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from epv_env.common.files import write_bytes

COLOURS = tuple(plt.rcParams["axes.prop_cycle"].by_key()["color"])
"""Of controllers, in their order."""


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG, whole or not at all, and free the figure."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130, bbox_inches="tight")
    write_bytes(path, stream.getvalue())
    plt.close(figure)


WORDS = {
    "region": "plants",
    "calibrated": "the plant itself",
    "exact": "the plant itself",
    "confidence": "its confidence region",
    "ten_percent": "4 parameters ±10 %",
    "sensitive_ten_percent": "13 parameters ±10 %",
    "domain": "4 parameters in their domains",
    "diagnosis": "what the diagnosis holds possible",
}
"""What people read instead of the names of plant sets."""


def in_words(name: str) -> str:
    """A plant set, an effect or another factor as people read it."""
    return WORDS.get(name, name.replace("_", " "))
