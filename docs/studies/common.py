"""What the studies share: their two options, and pages with generated parts.

A generated part of a page stands between two markers:

    <!-- generated: NAME, study STUDY, code CODE -->
    ... whatever the study last wrote ...
    <!-- end: NAME -->

`docs.studies.freshness` says what the code is. Parts that hold no figure of a study have neither.
"""

import argparse
import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from docs.studies.freshness import ROOT, code_of
from epv_env.common.files import write_text

PAGE = "README.md"
"""Name of a study's page."""


def study_parser(description: str, folder: Path) -> argparse.ArgumentParser:
    """A parser with the options that every study has: --quick and --out. `study_options` reads it.

    Args:
        description: the study's docstring; its first line becomes the help.
        folder: of the study, where results and page stand.
    """
    parser = argparse.ArgumentParser(description=description.strip().splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a short run that shows that all works")
    parser.add_argument(
        "--out",
        type=Path,
        help="folder of the results and the page (default: the study's; runs/NAME-quick with --quick)",
    )
    parser.set_defaults(folder=folder)
    return parser


def study_options(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None = None
) -> argparse.Namespace:
    """The options, and `work`: the folder for what runs of the same code share, such as a journal.

    Another folder than the study's gets a copy of the page: a trial run changes nothing published.
    """
    options = parser.parse_args(arguments)
    runs, name = ROOT / "runs", options.folder.name
    if options.out is None:
        options.out = runs / f"{name}-quick" if options.quick else options.folder
    options.work = options.out if options.quick else runs / name / code_of(name)
    options.out.mkdir(parents=True, exist_ok=True)
    page = options.folder / PAGE
    if options.out.resolve() != options.folder.resolve() and page.exists():
        shutil.copy(page, options.out / PAGE)
    return options


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def fill(page: Path, parts: Mapping[str, str]) -> None:
    """Write a page's generated parts, given by name; the rest of the page stays as it is.

    Raises ValueError for a part that the page has no markers for, before anything is written.
    """
    text = page.read_text(encoding="utf-8")
    for name, part in parts.items():
        end = f"<!-- end: {name} -->"
        begin = rf"<!-- generated: {re.escape(name)}(?:, study (\w+), code \w+)? -->"
        if not (found := re.search(rf"{begin}\n.*?{end}", text, re.DOTALL)):
            raise ValueError(f"{page}: put <!-- generated: {name} --> and {end} where this part belongs")
        code = f", study {found[1]}, code {code_of(found[1])}" if found[1] else ""
        filled = f"<!-- generated: {name}{code} -->\n{part.strip()}\n{end}"
        text = text[: found.start()] + filled + text[found.end() :]
    write_text(page, text)
