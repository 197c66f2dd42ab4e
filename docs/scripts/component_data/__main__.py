"""Compute, print and draw the results of docs/results/component-data.md."""

import argparse
import sys
from pathlib import Path

from docs.scripts.component_data.component_figure import component_figure
from docs.scripts.component_data.component_results import component_results
from docs.scripts.component_data.text_tables import chamber_table, friction_table, solenoid_table
from epv_env.common.command_line import fail_clearly, writable_folder


def main() -> int:
    """Compute, print and draw; returns the exit status."""
    parser = argparse.ArgumentParser(description="Draw the figure of docs/results/component-data.md.")
    parser.add_argument("--data", type=Path, required=True, help="folder of the measured data")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of the picture")
    chosen = parser.parse_args()
    results = component_results(chosen.data)
    print(
        "\n".join([*friction_table(results), "", *chamber_table(results), "", *solenoid_table(results)])
    )
    chosen.out.mkdir(parents=True, exist_ok=True)
    component_figure(results).savefig(chosen.out / "component-data.png", dpi=100, bbox_inches="tight")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
