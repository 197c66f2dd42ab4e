"""A self-contained HTML report: sections of verdicts, text, tables and figures."""

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from epv_env.common.files import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One finding, as a sentence."""

    status: str
    """'good', 'doubt', 'bad' or 'note'."""
    text: str


@dataclass(frozen=True, kw_only=True)
class Text:
    """A paragraph."""

    text: str


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


Block = Text | Table | Picture


@dataclass(frozen=True, kw_only=True)
class Section:
    """One stage of the identification: its verdicts first, then what supports them."""

    title: str
    verdicts: Sequence[Verdict]
    blocks: Sequence[Block]


_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1c2733; max-width: 62rem; margin: 2rem auto;
       padding: 0 1rem }
h1 { font-size: 1.6rem } h2 { font-size: 1.25rem; margin-top: 2.5rem; border-bottom: 1px solid #cbd5e0 }
table { border-collapse: collapse; margin: .4rem 0 1.4rem; font-variant-numeric: tabular-nums }
caption { text-align: left; color: #52606d; padding-bottom: .3rem }
th, td { padding: .15rem .7rem; border-bottom: 1px solid #e2e8f0; text-align: right }
th:first-child, td:first-child { text-align: left } th { border-bottom: 1px solid #52606d }
figure { margin: .6rem 0 1.6rem } figure img { max-width: 100% } figcaption { color: #52606d }
.verdicts { list-style: none; padding: 0 } .verdicts li { padding: .2rem .7rem; margin: .25rem 0;
  border-left: .35rem solid } .good { border-color: #2f855a } .doubt { border-color: #dd9b00 }
.bad { border-color: #c53030 } .note { border-color: #a0aec0 }
footer { color: #52606d; margin-top: 3rem; border-top: 1px solid #cbd5e0; font-size: .85rem }
@media print { body { margin: 0; max-width: none; font-size: 10pt } h2 { break-after: avoid }
  figure, table, .verdicts li { break-inside: avoid } }
"""

_LABELS = {"good": "good", "doubt": "in doubt", "bad": "not acceptable", "note": "note"}


def write_page(path: Path, *, title: str, sections: Sequence[Section], footer: str = "") -> None:
    """Write sections as one HTML file that needs no other, whole or not at all.

    The verdicts of all sections stand first. Figures are closed by their owner, not here.
    """
    summary = "".join(
        f"<h3>{html.escape(section.title)}</h3>{_verdicts(section.verdicts)}" for section in sections
    )
    opening = f"<h2>Verdicts</h2>{summary}" if len(sections) > 1 else ""
    body = "".join(_section(section) for section in sections)
    write_text(
        path,
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}'
        f"</title><style>{_STYLE}</style></head><body><h1>{html.escape(title)}</h1>{opening}{body}"
        f"<footer>{html.escape(footer)}</footer></body></html>\n",
    )


def _section(section: Section) -> str:
    blocks = "".join(_block(block) for block in section.blocks)
    return f"<h2>{html.escape(section.title)}</h2>{_verdicts(section.verdicts)}{blocks}"


def _verdicts(verdicts: Sequence[Verdict]) -> str:
    items = "".join(
        f'<li class="{v.status}"><b>{_LABELS[v.status]}</b>: {html.escape(v.text)}</li>'
        for v in verdicts
    )
    return f'<ul class="verdicts">{items}</ul>'


def _block(block: Block) -> str:
    if isinstance(block, Text):
        return f"<p>{html.escape(block.text)}</p>"
    if isinstance(block, Table):
        return _table(block)
    return _picture(block)


def _table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(column)}</th>" for column in table.columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    caption = f"<caption>{html.escape(table.caption)}</caption>" if table.caption else ""
    return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _picture(picture: Picture) -> str:
    stream = io.BytesIO()
    picture.figure.savefig(stream, format="png", dpi=110, bbox_inches="tight")
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    caption = html.escape(picture.caption)
    return (
        f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
