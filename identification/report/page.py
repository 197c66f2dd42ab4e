"""A self-contained HTML report: sections of verdicts, text, tables and figures.

The page's form stands in page.html, a Jinja2 template, and its looks in page.css; here is only what goes
into it. Figures become SVG images, which stay sharp at every zoom.
"""

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from epv_env.common.command_line import NextStep
from epv_env.common.extras import how_to_install
from epv_env.common.files import write_json, write_text

if TYPE_CHECKING:
    from jinja2 import Environment
    from matplotlib.figure import Figure


LARGEST_CLOUD = 500
"""Points of one line with markers [1]: more are drawn as pixels, for each point costs 80 characters."""

RESOLUTION = 200
"""Of what is drawn as pixels [dots per inch]: sharp in print and at twice the screen's size."""

LABELS = {
    "good": "good", "doubt": "in doubt", "bad": "not acceptable", "why": "why", "next": "next",
    "note": "note",
}  # fmt: skip
"""What the page says for each status of a verdict; 'why' is a reason of the doubt before it."""

ANSWERS = {"good": "yes", "doubt": "with care", "bad": "no"}
"""Whether to trust a value, by its status."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One conclusion, as a sentence."""

    status: str
    """One of LABELS."""
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
    statuses: Sequence[str] = ()
    """Status of each row, which colours its last cell; empty for a table that judges nothing."""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A matplotlib figure, embedded as SVG, so that people can enlarge it."""

    figure: "Figure"
    caption: str = ""

    @property
    def link(self) -> str:
        """The figure as the address of an image, drawn anew at each call."""
        encoded = base64.b64encode(as_svg(self.figure).encode("utf-8")).decode("ascii")
        return f"data:image/svg+xml;base64,{encoded}"


Block = Text | Table | Picture
"""Part of a section."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One stage of the identification: its verdicts first, then what supports them."""

    title: str
    """Heading."""
    verdicts: Sequence[Verdict] = ()
    blocks: Sequence[Block] = ()
    summary: bool = False
    """True for the section that answers the reader's question: it alone stands open."""


def write_page(
    path: Path,
    *,
    title: str,
    sections: Sequence[Section],
    facts: Mapping[str, str] | None = None,
    footer: str = "",
    next_step: NextStep | None = None,
    written: datetime | None = None,
) -> None:
    """Write sections as one HTML file that needs no other, whole or not at all.

    The summary stands open with the next step; all other sections are folded, and say what is in doubt.

    Args:
        path: the file.
        title: heading of the page.
        sections: in the order of the page.
        facts: what the page rests on, by name: campaign, recordings.
        footer: a sentence at the end.
        next_step: the command to run next; None where the reader's plant has none.
        written: date on the page; None for now.

    Raises:
        ImportError: Jinja2 is not installed.
    """
    date = written or datetime.now().astimezone()
    page = (
        templates(autoescape=True)
        .get_template("report/page.html")
        .render(
            title=title,
            facts={**(facts or {}), "Written": f"{date.day} {date:%B %Y, %H:%M}"},
            sections=sections,
            labels=LABELS,
            footer=footer,
            next_step=next_step,
        )
    )
    write_text(path, page + "\n")


def templates(*, autoescape: bool) -> "Environment":
    """The package's templates. Raises ImportError where Jinja2 is not installed."""
    try:
        from jinja2 import Environment, PackageLoader, StrictUndefined
    except ImportError:
        raise ImportError(
            f"a report needs Jinja2, which is not installed: {how_to_install('identification')}"
        ) from None
    return Environment(
        loader=PackageLoader("identification", package_path=""),
        autoescape=autoescape,
        undefined=StrictUndefined,
    )


def write_results(
    out: Path,
    name: str,
    *,
    title: str,
    sections: Sequence[Section],
    content: Mapping[str, Any],
    facts: Mapping[str, str] | None = None,
    next_step: NextStep | None = None,
) -> None:
    """Write `out/name.json` and the self-contained `out/name.html`, each whole or not at all.

    facts: what the page rests on, by name. next_step: the command to run next.
    """
    write_json(out / f"{name}.json", content, allow_nan=False)
    write_page(
        out / f"{name}.html",
        title=title,
        sections=sections,
        facts=facts,
        footer=f"Written by epv-valve {version('epv-valve')}.",
        next_step=next_step,
    )


def as_text(sections: Sequence[Section]) -> str:
    """The verdicts, and what a summary judges, for a terminal."""
    lines = []
    for section in sections:
        lines += ["", section.title]
        lines += [f"  {verdict.status:5} {verdict.text}" for verdict in section.verdicts]
        judged = [block for block in section.blocks if isinstance(block, Table) and section.summary]
        for row in [row for table in judged for row in [table.columns, *table.rows]]:
            lines.append(f"  {' | '.join(row)}")
    return "\n".join(lines).lstrip()


def as_svg(figure: "Figure") -> str:
    """The figure as SVG text, always the same for the same figure; its clouds become pixels for good."""
    from matplotlib import rc_context  # only where a figure is drawn: matplotlib is slow to load

    for line in figure.findobj(_is_cloud):
        line.set_rasterized(True)
    stream = io.StringIO()
    # Letters become paths, so that they look alike on machines without matplotlib's fonts; a fixed salt
    # makes the same names in every file; lines are simplified within a fifth of a pixel.
    with rc_context(
        {"svg.fonttype": "path", "svg.hashsalt": "epv-valve", "path.simplify_threshold": 0.2}
    ):
        figure.savefig(
            stream, format="svg", dpi=RESOLUTION, bbox_inches="tight", metadata={"Date": None}
        )
    return stream.getvalue()


def _is_cloud(artist: object) -> bool:
    """Whether an artist is a line with so many markers that each as a shape would fill the file."""
    from matplotlib.lines import Line2D

    if not isinstance(artist, Line2D) or artist.get_marker() in ("", " ", "None", None):
        return False
    return np.size(artist.get_xdata()) > LARGEST_CLOUD
