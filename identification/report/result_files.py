"""Writing the results of a command: a page to read and a file to compute with."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from epv_env.common.json_files import write_json
from identification.report.page import Section, write_page


def write_results(
    out: Path, name: str, *, title: str, sections: Sequence[Section], content: Mapping[str, Any]
) -> None:
    """Write `out/name.json` and the self-contained `out/name.html`, each whole or not at all."""
    write_json(out / f"{name}.json", content, allow_nan=False)
    footer = (
        f"Written by epv-valve {version('epv-valve')}. Sections and tables are those of SCL-001/2003."
    )
    write_page(out / f"{name}.html", title=title, sections=sections, footer=footer)


def as_text(sections: Sequence[Section]) -> str:
    """The verdicts, for a terminal."""
    lines = []
    for section in sections:
        lines += ["", section.title]
        lines += [f"  {verdict.status:5} {verdict.text}" for verdict in section.verdicts]
    return "\n".join(lines).lstrip()
