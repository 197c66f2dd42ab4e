"""How well logs of a control unit tell causes: simulated valves whose effects deviate from the laws.

    python -m docs.studies.logs.study

drives valves with and without an effect by the package's policy, and diagnoses their logs. valves.jsonl
keeps each answer; logs and finished fits are in runs/logs/CODE.
"""

import shutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike

from controllers.policy import TRAINED, load_policy
from controllers.policy_files import policy_digest
from docs.studies.blind.forms import deviating_sizes
from docs.studies.blind.score import named_cause
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, read_bytes, write_bytes
from epv_env.common.options import COUNT
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import CALIBRATED_SYMBOLS
from epv_env.plant.valves import Valves
from identification.gap.judge.verdict import NO_GAP
from identification.gap.report.gap_json import as_json
from identification.recordings.log_files import read_log
from identification.recordings.openings import drive_of, openings
from identification.valve_gap.operation import diagnose_log
from training.drives import write_log
from training.evaluation.batches import run_jobs

FOLDER = Path(__file__).parent
SEED = 4931
VALVES, WITHOUT = 100, 5
"""Valves; every fifth has no effect."""
DRIVES, QUICK, DURATION = 10, 4, 30.0
"""Drives of a valve, the same under --quick, and length of a drive [s]: five minutes in all."""
SPREAD, SIZES, DEVIATIONS = (0.94, 1.06), (1.0, 2.0), (0.2, 0.5)
"""Ranges of the calibrated parameters, as shares of the report's; of an effect's size, in sizes from
which a fit begins; and of the deviation of its law [1]."""
PARTS = 5
"""Parts of a control period, in each of which a deviating size is held."""


def drawn(number: int, drives: int = DRIVES) -> dict[str, Any]:
    """A valve: parameters, label and sizes of its effect, deviation, first drive with it, and seeds."""
    rng = np.random.default_rng([SEED, number])
    p = Plant.calibrated().parameters
    parameters = {s: p[s] * rng.uniform(*SPREAD) for s in CALIBRATED_SYMBOLS}
    valve = {"parameters": parameters, "seeds": rng.integers(2**32, size=drives).tolist()}
    if number % WITHOUT == 0:
        return valve | {"cause": "", "label": "", "effects": {}, "deviation": 0.0, "onset": 0}
    effect = EFFECTS[int(rng.integers(len(EFFECTS)))]
    variant = str(rng.choice(list(effect.fitted)))
    factor, deviation = rng.uniform(*SIZES), rng.uniform(*DEVIATIONS)
    sizes = {
        s.symbol: s.trials[0] * (1 / factor if s.stronger_when_smaller else factor)
        for s in effect.fitted[variant]
        if s.trials
    }
    label = f"{effect.name} ({variant})" if variant else effect.name
    onset = int(rng.integers(drives // 2 + 1))  # the effect acts for half of the time at least
    own = {"cause": effect.name, "label": label, "effects": {effect.name: sizes}}
    return valve | own | {"deviation": deviation, "onset": onset}


def log_drives(valve: dict[str, Any], folder: Path) -> None:
    """Drive a valve and log it."""
    plant, policy = Plant.calibrated(), load_policy()
    plant = replace(plant, parameters=plant.parameters.replace(**valve["parameters"]))
    write_log(
        folder, policy, plant, valve["seeds"], duration=DURATION, effects=valve["effects"],
        onset=valve["onset"], begun=lambda valves: deviate(valves, [valve["deviation"]]),
    )  # fmt: skip


def deviate(valves: Valves, deviations: Sequence[float]) -> None:
    """Have the sizes of each valve's effects depend on its state, as in docs/studies/blind/forms.py."""
    tables = valves.tables
    fitted, by = tables.effects.copy(), np.array(deviations)

    def in_parts(duration: ArrayLike) -> None:
        inputs = np.array(valves.inputs)
        for _ in range(PARTS):
            set_sizes(tables.state, inputs, tables.coefficients, tables.effects, fitted, by)
            Valves.advance(valves, np.asarray(duration) / PARTS)

    valves.advance = in_parts


@numba.njit
def set_sizes(state, inputs, coefficients, effects, fitted, deviations):
    """Write the sizes at the valves' states into their table `effects`; deviations: (valves,) [1]."""
    for i, d in enumerate(deviations):
        q, u = state_at(state, 0, i), inputs_at(inputs, 0, i)
        sizes = deviating_sizes(q, u, coefficients_at(coefficients, 0, i), effects_at(fitted, 0, i), d)
        for row in range(len(sizes)):
            effects[row, i] = sizes[row]


def answer(valve: dict[str, Any], folder: Path) -> dict[str, Any]:
    """What the diagnosis says of a valve's log, and whether that is right."""
    log, driven = folder / "log", folder / "driven"
    if not driven.exists():
        shutil.rmtree(log, ignore_errors=True)
        log_drives(valve, log)
        driven.touch()
    return judged(valve, log, as_json(diagnose_log(log, folder / "out", report=False)))


def judged(valve: dict[str, Any], log: Path, found: dict[str, Any]) -> dict[str, Any]:
    """The content of gap.json beside the truth; log: the folder, for the drives that have openings."""
    compared, _ = openings(read_log(log), Plant.calibrated().parameters)
    drives = list(dict.fromkeys(drive_of(each.name) for each in compared.recordings))
    number = {f"drive-{k + 1}.csv": k for k in range(len(valve["seeds"]))}
    first = next((number[drive] for drive in drives if number[drive] >= valve["onset"]), -1)
    onset = found["onset"] or dict.fromkeys(("drive", "earliest", "latest"), drives[0])
    began, earliest, latest = (number[onset[name]] for name in ("drive", "earliest", "latest"))
    true, named = (valve["cause"],), named_cause(found)
    return {
        "label": valve["label"],
        "verdict": found["verdict"],
        "named": named,
        "told": valve["label"] not in found["not_identifiable"],
        "listed": [true] == [tuple(cause["effects"]) for cause in found["causes"][:1]],
        "right": named == true,
        "in_set": true in map(tuple, found["ambiguity_set"]),
        "onset": began == first,
        "between": earliest <= first <= latest,
    }


def rows(answers: Sequence[dict[str, Any]]) -> list[list[str]]:
    """Counts for the page's table."""
    struck = [each for each in answers if each["label"]]
    healthy = [each["verdict"] != NO_GAP for each in answers if not each["label"]]
    told = [each for each in struck if each["told"]]
    named = [each for each in told if each["named"]]
    right = [each for each in named if each["right"]]
    return [
        ["Valves, each driven for five minutes", f"{len(answers)}"],
        ["False alarms, of valves without an effect", f"{sum(healthy)} of {len(healthy)}"],
        ["Effects that logs cannot tell", f"{len(struck) - len(told)} of {len(struck)}"],
        ["Most probable cause right, of effects that can be told, whatever the verdict",
         f"{sum(each['listed'] for each in told)} of {len(told)}"],
        ["A cause named, of effects that can be told", f"{len(named)} of {len(told)}"],
        ["Named cause right, of effects that can be told", f"{len(right)} of {len(told)}"],
        ["Named cause right, of those named", f"{len(right)} of {len(named)}"],
        ["Truth in the set, of those named", f"{sum(e['in_set'] for e in named)} of {len(named)}"],
        ["First drive right, where the cause is", f"{sum(e['onset'] for e in right)} of {len(right)}"],
        ["First drive between those given with 95 %, where the cause is",
         f"{sum(e['between'] for e in right)} of {len(right)}"],
    ]  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--valves", type=COUNT, default=VALVES)
    options = study_options(parser, arguments)
    numbers, drives = ([2], QUICK) if options.quick else (range(options.valves), DRIVES)
    effects, policy = [effect.name for effect in EFFECTS], policy_digest(TRAINED)
    subject = {"seed": SEED, "drives": drives, "effects": effects, "policy": policy}
    journal = Journal(options.work / "valves.jsonl", subject)
    jobs = {str(n): partial(answer, drawn(n, drives), options.work / str(n)) for n in numbers}
    # One process: `set_sizes` of this module, which is run as a script, cannot be sent to another.
    answers = run_jobs(jobs, journal=journal, workers=1, what="logs")
    write_bytes(options.out / journal.path.name, read_bytes(journal.path))
    fill(options.out / PAGE, {"figures": table(["", "Number"], rows(answers))})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
