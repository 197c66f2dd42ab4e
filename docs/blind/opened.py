"""Diagnose opened cases and score the answers against their labels.

    python -m docs.blind.opened ../shared/blind/round-4 ../shared/logs/logs-2 --out runs/opened

A folder holds labels.json and a campaign, or an operation log, for each case. Finished cases are not
diagnosed again.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from docs.studies.blind.score import NAMING_VERDICTS, named_cause
from docs.studies.blind.study import in_processes
from docs.studies.common import table
from epv_env.common.command_line import fail_clearly
from epv_env.plant.effects.registry import CATALOGUE
from identification.gap.report.gap_json import GAP
from identification.recordings.campaign_files import FILE_NAME
from identification.valve_gap.causes import PARAMETER_COMPONENTS
from identification.valve_gap.diagnose import diagnose_campaign
from identification.valve_gap.operation import diagnose_log

LABELS = "labels.json"
LATER_NAMES = {
    "output_sensor_gain": "pressure_sensor_gain",
    "control_sensor_gain": "pressure_sensor_gain",
}
"""Names of effects that came into the catalogue under another one."""
BINS = np.linspace(0.0, 1.0, 6)
"""Ends of the bins of the reliability table [1]."""


def diagnose(case: Path, out: Path) -> None:
    """Write gap.json of a campaign or a log; one that fails is told and writes nothing."""
    run = diagnose_campaign if (case / FILE_NAME).exists() else diagnose_log
    try:
        run(case, out, report=False)
    except Exception as error:  # one failure must not end the round
        print(f"{case}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)


def judged(truth: Sequence[str], answer: Mapping[str, Any]) -> dict[str, Any]:
    """The kind of a case and what the answer made of it; truth: effects that acted.

    A first cause is right if it names nothing untrue: of a pair the main one will do.
    """
    causes, verdict = answer.get("causes", []), answer["verdict"]
    first = causes[0]["effects"] if causes else []
    known = [*CATALOGUE, *(f"parameter:{symbol}" for symbol in PARAMETER_COMPONENTS)]
    catalogued = all(effect in known for effect in truth)
    right = bool(truth) and bool(first) and set(first) <= set(truth)
    return {
        "kind": "none" if not truth else "cause" if catalogued else "stranger",
        "verdict": verdict,
        "first": " + ".join(first),
        "probability": causes[0]["probability"] if causes else 0.0,
        "right": right,
        "named": bool(named_cause(answer)),
    }


def counts(cases: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Rows of what was asked and how often it came true."""

    def row(text: str, kind: str, *wanted: bool) -> list[str]:
        return [text, f"{sum(wanted)} of {sum(each['kind'] == kind for each in cases)}"]

    caused = [each for each in cases if each["kind"] == "cause"]
    others = {k: [each for each in cases if each["kind"] == k] for k in ("none", "stranger")}
    return [
        row("right cause first", "cause", *(e["right"] for e in caused)),
        row("right cause named", "cause", *(e["right"] and e["named"] for e in caused)),
        row("wrong cause named", "cause", *(e["named"] and not e["right"] for e in caused)),
        row("alarm without an effect", "none", *(e["verdict"] != "no_gap" for e in others["none"])),
        row("stranger named", "stranger", *(e["named"] for e in others["stranger"])),
        row("stranger `known`", "stranger", *(e["verdict"] == "known" for e in others["stranger"])),
    ]


def reliability(cases: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Stated probability of named causes against the share that is right, in bins."""
    named = [each for each in cases if each["verdict"] in NAMING_VERDICTS]
    rows = []
    for low, high in pairwise(BINS):
        own = [e for e in named if low <= e["probability"] < high or e["probability"] == high == 1.0]
        stated = f"{np.mean([e['probability'] for e in own]):.2f}" if own else "-"
        rows.append(
            [f"{low:.1f} to {high:.1f}", stated, f"{sum(e['right'] for e in own)} of {len(own)}"]
        )
    return rows


def labels_of(folder: Path) -> dict[str, Any]:
    """Labels by case. Raises ValueError for a folder without them."""
    path = folder / LABELS
    if not path.exists():
        raise ValueError(f"{folder} has no {LABELS}: give the folder of a round whose labels are opened")
    return json.loads(path.read_text(encoding="utf-8"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose what is missing, and print the scores; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("rounds", type=Path, nargs="+", help="folders with labels.json")
    parser.add_argument("--out", type=Path, required=True, help="folder of the answers")
    options = parser.parse_args(arguments)
    labels = {
        (folder / name, options.out / folder.name / name): label
        for folder in options.rounds
        for name, label in labels_of(folder).items()
    }
    missing = [pair for pair in labels if not (pair[1] / GAP).exists()]
    if missing:
        in_processes(diagnose, missing, what="opened cases")
    cases = []
    for (_, out), label in labels.items():
        answer = json.loads((out / GAP).read_text()) if (out / GAP).exists() else {"verdict": "failed"}
        truth = [str(LATER_NAMES.get(effect, effect)) for effect in label["effects"]]
        cases.append({"case": f"{out.parent.name}/{out.name}", "truth": " + ".join(truth) or "-"})
        cases[-1] |= judged(truth, answer)
    columns = ("case", "truth", "verdict", "first", "probability", "right")
    print(table(columns, [[_cell(each[name]) for name in columns] for each in cases]), end="\n\n")
    print(table(("what", "count"), counts(cases)), end="\n\n")
    print(table(("probability of the name", "mean", "right"), reliability(cases)))
    return 0


def _cell(value: Any) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
