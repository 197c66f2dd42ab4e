"""Write the valve or an exported policy as Functional Mock-up Units, for Simulink and other tools.

    python training/export_fmu.py plant --out runs/fmu
    python training/export_fmu.py policy runs/ecu --out runs/fmu

Each writes two files, after FMI 2.0 and FMI 3.0, for co-simulation: C sources, and a library for this
platform if a C compiler is there. docs/reference/fmu.md says what is in them.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import os
import sys
from pathlib import Path

from epv_env.common.command_line import fail_clearly, writable_folder
from epv_env.common.files import write_bytes
from epv_env.plant.plantfile import load_plant
from training.deploy.fmu.files import VERSIONS, compiler_words, fmu
from training.deploy.fmu.plant_model import plant_model
from training.deploy.fmu.policy_model import policy_model
from training.deploy.fmu.variables import Model


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        description="Write the valve or an exported policy as Functional Mock-up Units (FMI 2 and 3)."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    plant = commands.add_parser(
        "plant", help="the valve", description="Write the valve, with all effects, as FMUs."
    )
    plant.add_argument("--plant", type=Path, help="plant file (default: the report's calibration)")
    policy = commands.add_parser(
        "policy", help="an exported policy", description="Write an exported policy as FMUs."
    )
    policy.add_argument("export", type=Path, help="folder that training/export.py wrote")
    for each in (plant, policy):
        each.add_argument("--out", type=writable_folder, required=True, help="folder to write into")
        each.add_argument(
            "--compiler",
            default=os.environ.get("CC", "cc"),
            help="C compiler of the library for this platform; '' for sources alone (default: cc)",
        )
    return parser.parse_args(arguments)


def model_of(chosen: argparse.Namespace) -> Model:
    """The model that the options ask for. Raises ExportError or PlantFileError."""
    if chosen.command == "plant":
        return plant_model(load_plant(chosen.plant))
    return policy_model(chosen.export)


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    model = model_of(chosen)
    archives = {version: fmu(model, version, chosen.compiler) for version in VERSIONS}
    for version, content in archives.items():
        path = chosen.out / f"{model.identifier}_fmi{version[0]}.fmu"
        write_bytes(path, content)
        print(f"written to {path}")
    if not compiler_words(chosen.compiler):
        print("without a library: no C compiler; the importing tool has to compile the sources")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
