"""The console command `epv`: every command of the project by one name."""

import sys

from epv_env.common.commands import main as run_command

PACKAGES = ("training.commands", "identification.commands")
GIVEN = {"gap": "training.closed_loop:sections_about"}
"""What a command gets that its package may not import."""


def main() -> int:
    """The entry point of the console script."""
    return run_command(PACKAGES, program="epv", given=GIVEN)


if __name__ == "__main__":
    sys.exit(main())
