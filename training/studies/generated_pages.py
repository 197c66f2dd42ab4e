"""Pages with generated parts: what stands between a part's two markers is written by a command.

    <!-- generated: NAME -->
    ... whatever the command last wrote ...
    <!-- end: NAME -->

Several commands may write into one page, each the parts that it knows.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from epv_env.common.files import write_text


def markdown(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as Markdown."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def check_pages(pages: Sequence[Path], parts: Sequence[str]) -> None:
    """Raises ValueError for a page that `fill` could not fill with any of the parts of these names."""
    for page in pages:
        if not page.is_file():
            raise ValueError(f"no page {page}: give Markdown files with generated parts")
        text = page.read_text(encoding="utf-8")
        wanted = _wanted(text, parts)
        if not wanted:
            raise ValueError(
                f"{page} asks for none of the parts that can be written: mark one with "
                f"{_begin('NAME')}; known are {', '.join(parts)}"
            )
        for name in wanted:
            if _end(name) not in text.partition(_begin(name))[2]:
                raise ValueError(f"{page}: {_begin(name)} has no {_end(name)} after it: add it")


def fill(page: Path, parts: Mapping[str, str]) -> None:
    """Write the parts that the page has markers for; the rest of it stays as it is.

    Raises ValueError as `check_pages`, before anything is written.
    """
    check_pages([page], list(parts))
    text = page.read_text(encoding="utf-8")
    for name in _wanted(text, list(parts)):
        before, begin, rest = text.partition(_begin(name))
        _, end, after = rest.partition(_end(name))
        text = f"{before}{begin}\n{parts[name].strip()}\n{end}{after}"
    write_text(page, text)


def _wanted(text: str, parts: Sequence[str]) -> list[str]:
    """Those of the parts that a page has markers for."""
    return [name for name in parts if _begin(name) in text.splitlines()]


def _begin(name: str) -> str:
    """The marker before a part."""
    return f"<!-- generated: {name} -->"


def _end(name: str) -> str:
    """The marker after a part."""
    return f"<!-- end: {name} -->"
