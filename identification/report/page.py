"""A self-contained HTML report: sections of verdicts, text, tables and figures.

The page's form stands in page.html, a Jinja2 template, and its looks in page.css; here is only what goes
into it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from epv_env.common.extras import how_to_install
from epv_env.common.files import write_text

if TYPE_CHECKING:
    from jinja2 import Template
    from matplotlib.figure import Figure

LABELS = {"good": "good", "doubt": "in doubt", "bad": "not acceptable", "note": "note"}
"""What the page says for each status of a verdict."""

ANSWERS = {"good": "yes", "doubt": "with care", "bad": "no"}
"""Whether to trust a value, by its status."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One conclusion, as a sentence."""

    status: str
    """'good', 'doubt', 'bad' or 'note'."""
    text: str
    """One sentence; the page escapes it."""

    @property
    def label(self) -> str:
        """The status in words."""
        return LABELS[self.status]


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
    printed: str = ""
    """Where the report of 2003 prints the like, as in 'Table 12'; shown only where asked for."""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A matplotlib figure, embedded as SVG, so that people can enlarge it."""

    figure: "Figure"
    caption: str = ""
    printed: str = ""
    """Where the report of 2003 prints the like, as in 'Figure 4'; shown only where asked for."""

    @property
    def link(self) -> str:
        """The figure as the address of an image, drawn anew at each call."""
        # Only where a figure is drawn: matplotlib is slow to load.
        from identification.report.svg import as_data_link

        return as_data_link(self.figure)


Block = Text | Table | Picture
"""Part of a section."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One stage of the identification: its verdicts first, then what supports them."""

    title: str
    """Heading."""
    verdicts: Sequence[Verdict]
    blocks: Sequence[Block]
    summary: bool = False
    """True for the section that answers the reader's question: it stands right under the title."""
    printed: str = ""
    """The section of the report of 2003 with the like; shown only where asked for."""


def write_page(
    path: Path,
    *,
    title: str,
    sections: Sequence[Section],
    facts: Mapping[str, str] | None = None,
    footer: str = "",
    report_2003: bool = False,
    written: datetime | None = None,
) -> None:
    """Write sections as one HTML file that needs no other, whole or not at all.

    Summaries come first, then the contents and the verdicts of all other sections. The caller closes the
    figures.

    Args:
        path: the file.
        title: heading of the page.
        sections: in the order of the page.
        facts: what the page rests on, by name: campaign, recordings.
        footer: a sentence at the end.
        report_2003: whether to say where the report SCL-001/2003 prints the like.
        written: date on the page; None for now.

    Raises:
        ImportError: Jinja2 is not installed.
    """
    date = written or datetime.now().astimezone()
    page = _template().render(
        title=title,
        facts={**(facts or {}), "Written": f"{date.day} {date:%B %Y, %H:%M}"},
        summaries=[section for section in sections if section.summary],
        sections=[section for section in sections if not section.summary],
        footer=footer,
        report_2003=report_2003,
    )
    write_text(path, page + "\n")


@cache
def _template() -> "Template":
    """The page's template, every text escaped; only a page that is written needs Jinja2."""
    try:
        from jinja2 import Environment, PackageLoader, StrictUndefined
    except ImportError:
        raise ImportError(
            f"an HTML page needs Jinja2, which is not installed: {how_to_install('identification')}"
        ) from None
    environment = Environment(
        loader=PackageLoader("identification.report", package_path=""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html")
