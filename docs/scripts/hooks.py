"""What mkdocs runs while it builds the site: generated pages join those that are written by hand.

The API reference has one page for each folder of modules.
"""

import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parents[2]))

from docs.scripts import command_lines, effects_table

ROOT = Path(__file__).parents[2]
"""The repository's root."""
PACKAGES = ("epv_env", "controllers", "identification", "training")
"""Top-level packages, in the order in which the reference lists them."""
FOLDER = "reference/api"
"""Where the pages stand in the site."""
FOLDER_OPTIONS = """    options:
      members: []
      show_root_heading: false
      show_root_toc_entry: false"""
"""Show a folder's docstring only; its modules follow."""
GENERATED = {
    "<!-- generated: command lines -->": command_lines.page,
    "<!-- generated: effects -->": effects_table.effects_table,
}
"""Lines of pages, and what writes the text that replaces them."""


def on_config(config: Any) -> Any:
    """Put the API pages into the navigation."""
    for entry in config.nav:
        for part in entry.get("Reference", []):
            if "API" in part:
                part["API"] = api_navigation()
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the API pages."""
    for path, content in api_pages().items():
        files.append(File.generated(config, path, content=content))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write what a page asks for."""
    for line, write in GENERATED.items():
        if line in markdown:
            markdown = markdown.replace(line, write())
    return markdown


def _modules(package: Path) -> list[Path]:
    """Python files of one folder that hold code, alphabetically, without `__init__.py`."""
    return sorted(file for file in package.glob("*.py") if not file.name.startswith("__"))


def _folders(package: str) -> list[Path]:
    """The package's folder and all folders of modules below it."""
    top = ROOT / package
    found = sorted({file.parent for file in top.rglob("*.py") if "__pycache__" not in file.parts})
    return [folder for folder in found if _modules(folder)]


def _dotted(path: Path) -> str:
    """The name under which a folder or file is imported."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def api_pages() -> dict[str, str]:
    """Markdown by path in the site, one page for each folder of modules."""
    return {
        f"{FOLDER}/{_dotted(folder)}.md": _page(folder)
        for package in PACKAGES
        for folder in _folders(package)
    }


def _page(folder: Path) -> str:
    """A heading, the folder's docstring, and a line for each module, which mkdocstrings replaces."""
    name = _dotted(folder)
    sections = [f"::: {_dotted(module)}" for module in _modules(folder)]
    return "\n\n".join((f"# `{name}`", f"::: {name}\n{FOLDER_OPTIONS}", *sections)) + "\n"


def api_navigation() -> list[dict[str, object]]:
    """The pages as entries of the site's navigation, grouped by package."""
    return [
        {package: [{_dotted(folder): f"{FOLDER}/{_dotted(folder)}.md"} for folder in _folders(package)]}
        for package in PACKAGES
    ]
