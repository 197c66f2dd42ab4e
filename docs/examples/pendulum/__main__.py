"""Diagnose recordings of a pendulum."""

import sys

from docs.examples.pendulum.plant import pendulum
from docs.examples.recorded_plants import command
from epv_env.common.command_line import fail_clearly

if __name__ == "__main__":
    sys.exit(fail_clearly(lambda: command("a pendulum", "pendulum", pendulum)))
