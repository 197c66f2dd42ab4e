"""The API reference: one page for each package, its modules in alphabetical order."""

from pathlib import Path

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


def modules(package: Path) -> list[Path]:
    """Python files of one folder that hold code, alphabetically, without `__init__.py`."""
    return sorted(file for file in package.glob("*.py") if not file.name.startswith("__"))


def folders(package: str) -> list[Path]:
    """The package's folder and all folders of modules below it."""
    top = ROOT / package
    found = sorted({file.parent for file in top.rglob("*.py") if "__pycache__" not in file.parts})
    return [folder for folder in found if modules(folder)]


def dotted(path: Path) -> str:
    """The name under which a folder or file is imported."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def pages() -> dict[str, str]:
    """Markdown by path in the site, one page for each folder of modules."""
    return {
        f"{FOLDER}/{dotted(folder)}.md": _page(folder)
        for package in PACKAGES
        for folder in folders(package)
    }


def _page(folder: Path) -> str:
    """A heading, the folder's docstring, and a line for each module, which mkdocstrings replaces."""
    name = dotted(folder)
    sections = [f"::: {dotted(module)}" for module in modules(folder)]
    return "\n\n".join((f"# `{name}`", f"::: {name}\n{FOLDER_OPTIONS}", *sections)) + "\n"


def navigation() -> list[dict[str, object]]:
    """The pages as entries of the site's navigation, grouped by package."""
    return [
        {package: [{dotted(folder): f"{FOLDER}/{dotted(folder)}.md"} for folder in folders(package)]}
        for package in PACKAGES
    ]
