"""Identification from the command line: `python -m identification COMMAND --help`."""

import sys
from collections.abc import Sequence

from epv_env.common import commands


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    return commands.main(
        ("identification.commands",), program="python -m identification", arguments=arguments
    )


if __name__ == "__main__":
    sys.exit(main())
