"""The commands of `python -m identification`, in the order of its help."""

from identification.commands.bench import BENCH
from identification.commands.blind import BLIND
from identification.commands.command import Command
from identification.commands.coverage import COVERAGE
from identification.commands.gap import GAP
from identification.commands.import_files import IMPORT
from identification.commands.reproduce import REPRODUCE
from identification.commands.run import RUN
from identification.commands.stage import STAGE_COMMANDS

COMMANDS: tuple[Command, ...] = (BENCH, IMPORT, *STAGE_COMMANDS, RUN, COVERAGE, REPRODUCE, GAP, BLIND)
"""Every command; `python -m identification` offers no other."""
