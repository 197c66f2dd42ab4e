"""Export a trained policy for an electronic control unit.

    python training/export.py runs/ppo --out runs/ecu

or, for a policy that stable-baselines3 has saved,

    python training/export.py model.zip --out runs/ecu

writes the policy as ONNX, as C99 in single precision and in integers, the contract, and a parity test,
but only after the C code was compiled here and agreed with the policy on every one of 10,000 states.
docs/reference/exported-policy.md says what each file is.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import hashlib
import json
import os
import sys
import tempfile
from ctypes import CDLL
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from controllers.learned import LearnedPolicy, load_policy
from controllers.policy_contract import CONTRACT_FILE, WEIGHTS_FILE, read_contract
from epv_env.actions import OnOff
from epv_env.common.command_line import check_positive, fail_clearly, writable_folder
from training.deploy import measurements as measure
from training.deploy.atomic_folder import check_free, write_folder
from training.deploy.c_arrays import named_layers
from training.deploy.c_sources import Export, checks, sources
from training.deploy.compiled_export import CompiledPolicy, find_compiler, library
from training.deploy.deployment_contract import deployment_contract
from training.deploy.double_precision import in_double
from training.deploy.export_summary import as_text
from training.deploy.onnx_model import onnx_model
from training.deploy.quantisation import ExportError, quantise
from training.deploy.settings import SETTINGS, ExportSettings
from training.deploy.visited_states import states_table, visit
from training.evaluation.seeds import CALIBRATION_SEED, CLOSED_LOOP_SEED, STATES_SEED

FILES = {
    "policy.onnx", "epv_float.h", "epv_float.c", "epv_fixed.h", "epv_fixed.c", "contract.json",
    "states.csv", "states.h", "parity.c", "bench.c", "report.json",
}  # fmt: skip
"""What an export consists of."""
POLICY_FILES = (WEIGHTS_FILE, CONTRACT_FILE)
"""What is there besides if the policy comes from a .zip: the folder is then a policy's folder, too."""
BUILT = {"parity", "bench"}
"""What its reader builds there, and another export may sweep away."""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        description="Export a trained policy for an electronic control unit."
    )
    parser.add_argument(
        "policy",
        type=Path,
        help=f"folder with {WEIGHTS_FILE} and {CONTRACT_FILE}, or a .zip of stable-baselines3",
    )
    parser.add_argument("--out", type=writable_folder, required=True, help="folder to write")
    parser.add_argument(
        "--compiler", default=os.environ.get("CC", "cc"), help="C compiler (default: cc)"
    )
    parser.add_argument("--episodes", type=int, default=256, help="episodes under the compiled code")
    parser.add_argument("--duration", type=float, default=10.0, help="length of one of them [s]")
    chosen = parser.parse_args(arguments)
    check_positive(parser, chosen, "episodes", "duration")
    return chosen


def prepare(
    policy: LearnedPolicy, folder: Path, settings: ExportSettings = SETTINGS
) -> tuple[Export, dict[str, Any]]:
    """The policy with its integers, and its contract. Raises ExportError for another kind of policy."""
    check_exportable(policy, folder)
    content = read_contract(folder)
    digest = hashlib.sha256((folder / WEIGHTS_FILE).read_bytes()).hexdigest()
    calibration = visit(
        policy, first_seed=CALIBRATION_SEED, episodes=settings.episodes, periods=settings.periods
    )
    export = Export(
        policy=policy,
        fixed=quantise(policy, calibration.observations, settings=settings),
        period=content.observation.control_period_s,
        weights_sha256=digest,
    )
    return export, deployment_contract(export, provenance=content.provenance)


def policy_folder(given: Path, temporary: Path) -> Path:
    """The folder of a policy: what is given, or one made of a .zip. Raises ExportError."""
    if given.suffix != ".zip":
        return given
    from training.deploy.sb3_archive import read_sb3_archive
    from training.learners.policy_files import save_policy  # torch takes seconds to import: only now

    policy, provenance = read_sb3_archive(given)
    check_exportable(policy, given)
    save_policy(policy, temporary, control_period=OnOff.default_period, provenance=provenance)
    return temporary


def check_exportable(policy: LearnedPolicy, folder: Path) -> None:
    """Raises ExportError if the policy does not decide between off and on, or is damaged."""
    outputs = len(policy.layers[-1][1])
    if policy.environment != "EPValve-v0" or outputs != 2:
        raise ExportError(
            f"the policy in {folder} decides {outputs} things in {policy.environment}: only decisions "
            "between off and on (EPValve-v0) can be exported"
        )
    if not all(np.all(np.isfinite(array)) for layer in named_layers(policy).values() for array in layer):
        raise ExportError(f"the policy in {folder} has weights that are not finite: train it anew")


def verify(
    export: Export,
    compiler: list[str],
    chosen: argparse.Namespace,
    settings: ExportSettings = SETTINGS,
) -> tuple[dict[str, str], dict[str, Any]]:
    """The C files by name and the report, once compiled code has passed. Raises ExportError."""
    policy = export.policy
    states = visit(policy, first_seed=STATES_SEED, episodes=settings.episodes, periods=settings.periods)
    files = sources(export)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_texts(folder, files)
        code = library(compiler, folder)
        agreement = measure.agreement(policy, code, states)
        fixed_actions = measure.follow(
            CompiledPolicy(code=code, variant="fixed", cells=policy.cells), states
        )
        agreement["fixed_agrees"] = int(np.sum(fixed_actions == states.actions))
        margins = measure.margins(in_double(policy), states)
        tests = checks(states.actions.size, rounding=agreement["rounding_of_c"], settings=settings)
        tests["states.csv"] = states_table(states, margins, fixed_actions)
        write_texts(folder, tests)
        measure.run_parity(compiler, folder)
        report = {
            "agreement": agreement,
            "closed_loop": closed_loop(policy, code, chosen),
            "microseconds": measure.run_bench(compiler, folder),
            "machine": measure.machine(compiler),
        }
    return files | tests, report


def write_texts(folder: Path, files: dict[str, str]) -> None:
    """Write texts into a private folder."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def closed_loop(policy: LearnedPolicy, code: CDLL, chosen: argparse.Namespace) -> dict[str, Any]:
    """The figures of the compiled code in closed loop, with a progress bar."""
    seeds = list(range(CLOSED_LOOP_SEED, CLOSED_LOOP_SEED + chosen.episodes))
    with tqdm(total=100, desc="closed loop", bar_format="{l_bar}{bar}| {elapsed}<{remaining}") as bar:

        def show(share: float) -> None:
            bar.update(100 * share - bar.n)

        figures = measure.closed_loop(policy, code, seeds=seeds, duration=chosen.duration, progress=show)
    return {"episodes": chosen.episodes, "duration_s": chosen.duration, "controllers": figures}


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    # Only an earlier export of a .zip may go with its policy: a training's folder is never replaced.
    earlier = chosen.policy.suffix == ".zip" and (chosen.out / "contract.json").exists()
    check_free(chosen.out, FILES | BUILT | set(POLICY_FILES if earlier else ()))
    compiler = find_compiler(chosen.compiler)
    with tempfile.TemporaryDirectory() as temporary:
        folder = policy_folder(chosen.policy, Path(temporary))
        export, contract = prepare(load_policy(folder), folder)
        kept = POLICY_FILES if folder != chosen.policy else ()
        content = {name: (folder / name).read_bytes() for name in kept}
    files, report = verify(export, compiler, chosen)
    files["contract.json"] = json.dumps(contract, indent=1) + "\n"
    files["report.json"] = json.dumps(report, indent=1) + "\n"
    content |= {name: text.encode("utf-8") for name, text in files.items()}
    content["policy.onnx"] = onnx_model(export.policy, period=export.period).SerializeToString()
    write_folder(chosen.out, content)
    print(f"{as_text(report, contract)}\nwritten to {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
