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

from epv_env.common.command_line import NextStep
from epv_env.common.files import write_json, write_text

if TYPE_CHECKING:  # all are slow to load, and loaded only where a page is written
    from jinja2 import Environment
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

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
        """The figure as the address of an image, always the same for the same figure."""
        from matplotlib import rc_context

        stream = io.BytesIO()
        # Letters become paths, so that they look alike on machines without matplotlib's fonts; a fixed
        # salt makes the same names in every file; lines are simplified within a fifth of a pixel.
        with rc_context(
            {"svg.fonttype": "path", "svg.hashsalt": "epv-valve", "path.simplify_threshold": 0.2}
        ):
            self.figure.savefig(stream, format="svg", bbox_inches="tight", metadata={"Date": None})
        return f"data:image/svg+xml;base64,{base64.b64encode(stream.getvalue()).decode('ascii')}"


Block = str | Table | Picture
"""Part of a section; a string is a paragraph, which the page escapes."""


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
    next_step: NextStep | None = None,
) -> None:
    """Write sections as one HTML file that needs no other, whole or not at all.

    The summary stands open with the next step; all other sections are folded, and say what is in doubt.

    Args:
        path: the file.
        title: heading of the page.
        sections: in the order of the page.
        facts: what the page rests on, by name: campaign, recordings.
        next_step: the command to run next; None where the reader's plant has none.
    """
    now = datetime.now().astimezone()
    written = f"{now.day} {now:%B %Y, %H:%M}, by epv-valve {version('epv-valve')}"
    page = templates(autoescape=True).get_template("report/page.html")
    content = {"title": title, "sections": sections, "labels": LABELS, "next_step": next_step}
    write_text(path, page.render(content, facts={**(facts or {}), "Written": written}) + "\n")


def templates(*, autoescape: bool) -> "Environment":
    """The package's templates; autoescape: of HTML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("identification", package_path="")
    return Environment(loader=loader, autoescape=autoescape, undefined=StrictUndefined)


def write_results(out: Path, name: str, content: Mapping[str, Any], **page: Any) -> None:
    """Write `out/name.json` and the self-contained `out/name.html`, each whole or not at all.

    page: arguments of `write_page`.
    """
    write_json(out / f"{name}.json", content, allow_nan=False)
    write_page(out / f"{name}.html", **page)


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


LINES = {
    "measured": {"color": "black", "alpha": 0.35, "linewidth": 3.0},
    "model": {"color": "tab:blue"},
    "after": {"color": "tab:blue"},
    "before": {"color": "tab:orange", "linewidth": 1.6},
    "voltage": {"color": "tab:purple"},
    "readings": {"color": "0.55"},
    "trend": {"color": "tab:red"},
}
"""Looks of lines by the first word of their names, one colour for one thing; measured lies below."""


def over_time(
    time: "NDArray",
    rows: Mapping[str, Mapping[str, "NDArray"]],
    heights: Sequence[float] | None = None,
) -> "Figure":
    """A row for each label of an axis, with its lines by name; one legend for all.

    Args:
        time: (samples,) [s].
        rows: by label with its unit, each line (samples,) in that unit; NaN is not drawn.
        heights: of the rows, relative to each other.
    """
    from matplotlib.figure import Figure

    share = sum(heights) if heights else len(rows)
    figure = Figure(figsize=(7.0, 1.3 * share + 0.9), layout="constrained")
    drawn = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (label, lines) in zip(drawn, rows.items(), strict=True):
        for name, values in lines.items():
            look = {"linewidth": 0.9, **LINES.get(name.split(":")[0], {})}
            axes.plot(time, values, label=name, **look)
        axes.set_ylabel(label, fontsize="small")
        axes.grid(alpha=0.3)
    drawn[-1].set_xlabel("time [s]")
    lines = {line.get_label(): line for axes in drawn for line in axes.lines}
    place = {"ncols": 3, "loc": "outside upper center", "frameon": False, "fontsize": "small"}
    figure.legend(lines.values(), lines.keys(), **place)
    figure.align_ylabels()
    return figure
