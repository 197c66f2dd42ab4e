"""What a command of `python -m identification` consists of."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Command:
    """One command: its name, its options and its function.

    A new command takes two steps: a file of this folder that defines a Command, and a line in
    `registry.COMMANDS`.
    """

    name: str
    """Word after `python -m identification`."""
    help: str
    """What the command does, in one line of `python -m identification --help`."""
    add_options: Callable[[argparse.ArgumentParser], None]
    """Adds the options to the command's own parser, with the checks of their values."""
    run: Callable[[argparse.Namespace], None]
    """Runs the command with the parsed options. Raises ValueError or OSError with one sentence."""
    guide: str = ""
    """Page of the documentation, such as "docs/explanation/diagnosis.md"."""

    @property
    def description(self) -> str:
        """First lines of the command's own help."""
        return f"{self.help} ({self.guide})" if self.guide else self.help
