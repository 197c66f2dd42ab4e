"""Identification from the command line: `python -m identification COMMAND --help`."""

import argparse
import sys

from epv_env.common.command_line import fail_clearly
from epv_env.common.folder_lock import only_writer


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked; its `run` is the function of the chosen command."""
    from identification.commands.registry import COMMANDS  # its packages may be missing: only now

    program = "epv" if sys.argv[0] == "epv" else "python -m identification"
    parser = argparse.ArgumentParser(
        prog=program,
        description=(
            "Identify the valve from a campaign of recordings (docs/explanation/identification.md)."
        ),
    )
    parsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in COMMANDS:
        own = parsers.add_parser(command.name, help=command.help, description=command.description)
        command.add_options(own)
        own.set_defaults(run=command.run)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    from threadpoolctl import threadpool_limits

    chosen = parse(arguments)
    # The matrices are small: threads of the linear algebra would only wait for each other.
    with threadpool_limits(1), only_writer(chosen.out):
        chosen.run(chosen)
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
