"""Compute, print and draw what docs/component-data.md says."""

import argparse
import sys
from pathlib import Path

from docs.component_data.figure import drawn
from docs.component_data.findings import found_in
from docs.component_data.tables import chamber_table, friction_table, solenoid_table
from epv_env.common.command_line import fail_clearly, writable_folder


def main() -> int:
    """Compute, print and draw; returns the exit status."""
    parser = argparse.ArgumentParser(description="Draw the figure of docs/component-data.md.")
    parser.add_argument("--data", type=Path, required=True, help="folder of the measured data")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of the picture")
    chosen = parser.parse_args()
    found = found_in(chosen.data)
    print("\n".join([*friction_table(found), "", *chamber_table(found), "", *solenoid_table(found)]))
    chosen.out.mkdir(parents=True, exist_ok=True)
    drawn(found).savefig(chosen.out / "component-data.png", dpi=100, bbox_inches="tight")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
