"""Turn a policy into C and an FMU, or the plant into an FMU.

    epv export runs/ppo --out runs/ecu            # C
    epv export runs/ppo --out runs/ecu --fmu      # and epv_policy.fmu
    epv export plant --out runs/fmu               # epv_plant.fmu, of --plant FILE

A policy is written only after its C code was compiled here and agreed with the policy on every one of
10,000 states. docs/reference/exported-policy.md says what each file is, docs/reference/fmu.md the FMU.
"""

import hashlib
import json
import os
import secrets
import shutil
import tempfile
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any

from controllers.policy import TRAINED, load_policy
from controllers.policy_files import WEIGHTS_FILE, read_contract
from epv_env.common.command_line import NextStep, beside
from epv_env.common.files import check_writable, write_bytes
from epv_env.common.options import Count, Folder, JudgedSeconds, PlantFile
from epv_env.common.results_folder import LOCK_FILE
from epv_env.plant.plantfile import Plant, load_plant
from training.deploy import agreement as verdict
from training.deploy import compiled
from training.deploy.c_code import CODE, Export, deployment_contract, sources
from training.deploy.fmu.archive import fmu
from training.deploy.fmu.models import plant_model, policy_model
from training.deploy.translation import ExportError

PLANT = "plant"
"""What is exported in place of a policy's folder."""
FILES = {*CODE, "contract.json", "states.csv", "report.json", "epv_policy.fmu"}
"""What the export of a policy consists of."""


@dataclass(frozen=True)
class Options:
    """What is exported, how, and the check of the compiled code."""

    what: Annotated[str, f"a folder that training wrote, or `{PLANT}`"]
    _: KW_ONLY
    out: Annotated[Folder, "folder to write"]
    fmu: Annotated[bool, "an FMU of the policy, too"] = False
    plant: Annotated[
        PlantFile, "plant file: exported, or nominal for a policy (default: the report's)"
    ] = None
    compiler: Annotated[str, "C compiler; '' for a plant's sources alone"] = os.environ.get("CC", "cc")
    episodes: Annotated[Count, "under the compiled code"] = 256
    duration: JudgedSeconds = 10.0


def run(options: Options) -> None:
    """Write the files.

    Raises ExportError for another kind of policy, or code that does not decide as the policy.
    """
    if options.what == PLANT:
        model = plant_model(load_plant(options.plant))
        path = options.out / f"{model.identifier}.fmu"
        write_bytes(path, fmu(model, options.compiler))
        print(f"written to {path}")
        if not compiled.compiler_words(options.compiler):
            print("without a library: no C compiler; the importing tool has to compile the sources")
        return
    check_free(options.out)
    compiler = compiled.find_compiler(options.compiler)
    export = prepared(Path(options.what), load_plant(options.plant))
    files, report = verified(export, compiler, options.episodes, options.duration)
    contract = deployment_contract(export)
    files["contract.json"] = json.dumps(contract, indent=1) + "\n"
    files["report.json"] = json.dumps(report, indent=1) + "\n"
    content = {name: text.encode() for name, text in files.items()}
    if options.fmu:
        content["epv_policy.fmu"] = fmu(policy_model(export.period, files), options.compiler)
    write_folder(options.out, content)
    print(f"{verdict.as_text(report, contract)}\nwritten to {options.out}")


def next_step(options: Options) -> NextStep:
    """Export the other half of a closed loop of FMUs: the plant of a policy, the policy of a plant."""
    if options.what == PLANT:
        words = ("export", TRAINED, "--fmu", "--out", beside(options.out, "policy"))
        purpose = "to export the package's policy for the same simulator"
        return NextStep(purpose, words, options.plant)
    words = ("export", PLANT, "--out", beside(options.out, "plant"))
    return NextStep("to export the valve that it controls as an FMU", words, options.plant)


def prepared(folder: Path, plant: Plant) -> Export:
    """The controller in a folder that training wrote. plant: nominal, from which the learner starts."""
    content = read_contract(folder)
    return Export(
        policy=load_policy(folder, plant),
        period=content.observation.control_period_s,
        weights_sha256=hashlib.sha256((folder / WEIGHTS_FILE).read_bytes()).hexdigest(),
        provenance=content.provenance,
    )


def verified(
    export: Export, compiler: list[str], episodes: int, duration: float
) -> tuple[dict[str, str], dict[str, Any]]:
    """The C files and states.csv by name, and the report, once compiled code has passed.

    Args:
        export: the controller.
        compiler: the words of its command.
        episodes: under the compiled code.
        duration: length of one of them [s].

    Raises:
        ExportError: the code does not compile, or does not decide as the controller.
    """
    states = verdict.visit(export.policy)
    inputs = verdict.inputs_along(export, states)
    files = sources(export)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        code = compiled.library(compiler, folder)
        agreement = verdict.agreement(export, code, states, inputs)
        loop = verdict.closed_loop(export.policy, code, episodes=episodes, duration=duration)
        report = {
            "agreement": agreement,
            "closed_loop": {"episodes": episodes, "duration_s": duration, "controllers": loop},
            "machine": compiled.machine(compiler),
        }
    return files | {"states.csv": verdict.states_table(states, inputs)}, report


def check_free(folder: Path) -> None:
    """Raises ExportError or OSError if the folder holds anything but files of an earlier export."""
    there = {path.name for path in folder.iterdir()} if folder.exists() else set()
    if foreign := sorted(there - FILES - {LOCK_FILE}):
        raise ExportError(
            f"{folder} holds {foreign[0]!r}, which no export writes: give --out a new or empty folder"
        )
    for name in there:
        check_writable(folder / name)


def write_folder(folder: Path, files: dict[str, bytes]) -> None:
    """Put these files in place of an earlier export's; a failure to write leaves the earlier ones."""
    folder.mkdir(parents=True, exist_ok=True)
    new = folder / f".export.{secrets.token_hex(4)}"
    try:
        for name, content in files.items():
            write_bytes(new / name, content)
        for path in folder.iterdir():
            if path.name not in (*files, LOCK_FILE, new.name):
                path.unlink()
        for name in files:
            os.replace(new / name, folder / name)
    finally:
        shutil.rmtree(new, ignore_errors=True)
