"""A self-contained HTML report: sections of verdicts, text, tables and figures.

The page's form stands in page.html, a Jinja2 template; here is only what goes into it.
"""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from epv_env.common.files import write_text

if TYPE_CHECKING:
    from jinja2 import Template
    from matplotlib.figure import Figure

LABELS = {"good": "good", "doubt": "in doubt", "bad": "not acceptable", "note": "note"}
"""What the page says for each status of a verdict."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One conclusion, as a sentence."""

    status: str
    """'good', 'doubt', 'bad' or 'note'."""
    text: str
    """One sentence; the page escapes it."""


@dataclass(frozen=True, kw_only=True)
class Text:
    """A paragraph."""

    text: str
    """Plain text; the page escapes it."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; cells are text, ready to read."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A matplotlib figure, embedded as PNG."""

    figure: "Figure"
    caption: str = ""

    @property
    def png(self) -> str:
        """The figure as a PNG in base64, drawn anew at each call."""
        stream = io.BytesIO()
        self.figure.savefig(stream, format="png", dpi=110, bbox_inches="tight")
        return base64.b64encode(stream.getvalue()).decode("ascii")


Block = Text | Table | Picture
"""Part of a section."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One stage of the identification: its verdicts first, then what supports them."""

    title: str
    """Heading."""
    verdicts: Sequence[Verdict]
    blocks: Sequence[Block]


def write_page(path: Path, *, title: str, sections: Sequence[Section], footer: str = "") -> None:
    """Write sections as one HTML file that needs no other, whole or not at all.

    The verdicts of all sections come first. The caller closes the figures. Raises ImportError if
    Jinja2 is not installed.
    """
    page = _template().render(title=title, sections=sections, footer=footer, labels=LABELS)
    write_text(path, page + "\n")


@cache
def _template() -> "Template":
    """The page's template, every text escaped; only a page that is written needs Jinja2."""
    try:
        from jinja2 import Environment, PackageLoader, StrictUndefined
    except ImportError:
        raise ImportError(
            "an HTML page needs Jinja2, which is not installed: pip install 'epv-valve[identification]'"
        ) from None
    environment = Environment(
        loader=PackageLoader("identification.report", package_path=""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html")
