"""What mkdocs runs while it builds the site: generated pages join those that are written by hand."""

import logging
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parents[2]))

from docs.scripts import api_pages, command_lines, public_names

COMMAND_LINES = "<!-- generated: command lines -->"
"""The line of a page that the list of command lines replaces."""
LOG = logging.getLogger("mkdocs.hooks.public_names")
"""Its warnings fail a strict build."""
API = "API"
"""The entry of the navigation that holds the generated API pages."""


def on_config(config: Any) -> Any:
    """Put the API pages into the navigation; warn of public names without a docstring."""
    for name in public_names.undocumented_names():
        LOG.warning("%s has no docstring: give it one", name)
    for entry in config.nav:
        for part in entry.get("Reference", []):
            if API in part:
                part[API] = api_pages.navigation()
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the API pages."""
    for path, text in api_pages.pages().items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write the list of command lines where a page asks for it."""
    if COMMAND_LINES not in markdown:
        return markdown
    return markdown.replace(COMMAND_LINES, command_lines.page())
