"""Writing the results of a command: a page to read and a file to compute with."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from epv_env.common.files import write_json
from identification.report.page import Section, write_page


def write_results(
    out: Path,
    name: str,
    *,
    title: str,
    sections: Sequence[Section],
    content: Mapping[str, Any],
    facts: Mapping[str, str] | None = None,
    report_2003: bool = False,
) -> None:
    """Write `out/name.json` and the self-contained `out/name.html`, each whole or not at all.

    facts: what the page rests on, by name. report_2003: whether the page says where the report prints
    the like.
    """
    write_json(out / f"{name}.json", content, allow_nan=False)
    write_page(
        out / f"{name}.html",
        title=title,
        sections=sections,
        facts=facts,
        footer=f"Written by epv-valve {version('epv-valve')}.",
        report_2003=report_2003,
    )


def as_text(sections: Sequence[Section]) -> str:
    """The verdicts, for a terminal."""
    lines = []
    for section in sections:
        lines += ["", section.title]
        lines += [f"  {verdict.status:5} {verdict.text}" for verdict in section.verdicts]
    return "\n".join(lines).lstrip()
