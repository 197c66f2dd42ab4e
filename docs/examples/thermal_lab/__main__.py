"""Diagnose recordings of a thermal lab."""

import sys

from docs.examples.recorded_plants import command
from docs.examples.thermal_lab.plant import thermal_lab
from epv_env.common.command_line import fail_clearly

if __name__ == "__main__":
    sys.exit(fail_clearly(lambda: command("a thermal lab", "thermal-lab", thermal_lab)))
