"""Diagnose recordings of a toy car."""

import sys

from docs.examples.recorded_plants import command
from docs.examples.toy_car.plant import toy_car
from epv_env.common.command_line import fail_clearly

if __name__ == "__main__":
    sys.exit(fail_clearly(lambda: command("a toy car", "toy-car", toy_car)))
