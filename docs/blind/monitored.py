"""Monitor the valves of a round of logs, write the answers, and score them if the labels are opened.

    python -m docs.blind.monitored ../shared/logs/logs-3 --out runs/monitored

writes docs/blind/logs-3-monitor.csv. Finished valves are not monitored again.
"""

import argparse
import csv
import io
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from docs.blind.opened import LABELS
from docs.studies.common import table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, write_text
from epv_env.common.results_folder import progress
from identification.commands.monitor import LEARN
from identification.gap.diagnosis import Diagnosis
from identification.valve_gap.monitor import monitor_log

FOLDER = Path(__file__).parent
COLUMNS = ("case", "from the start", "since", "earliest", "latest", "mended", "what", "P", "seconds")
"""Drives by number from 1. What: the most probable cause of a change, with the verdict where that names
none. P: its probability."""


def answer(log: Path, out: Path) -> dict[str, Any]:
    """COLUMNS of one log but its case."""
    began = perf_counter()
    heard = monitor_log(log, out, learn=LEARN)
    number = {drive.file: k for k, drive in enumerate(heard.log.drives, start=1)}
    told: dict[str, Any] = dict.fromkeys(COLUMNS[1:], "")
    if heard.learnt and heard.learnt.best and not heard.learnt.onset:
        told["from the start"] = _named(heard.learnt)
    found = heard.found
    if found and found.onset:
        onset = found.onset
        told |= {name: number[getattr(onset, name)] for name in ("earliest", "latest")}
        told |= {"since": number[onset.drive], "mended": number.get(onset.mended or "", "")}
        told |= {"what": _named(found), "P": f"{found.best.probability:.2g}"}  # type: ignore[union-attr]
    return told | {"seconds": round(perf_counter() - began)}


def _named(found: Diagnosis) -> str:
    effects = " + ".join(found.best.effects) if found.best else ""
    return effects if found.named else f"{effects} ({found.conclusion.verdict})"


def counts(answers: Mapping[str, Mapping[str, Any]], labels: Mapping[str, Any]) -> list[list[str]]:
    """What was asked and how often it came true; changes begin with a later drive than the first."""
    pairs = [(labels[case], told) for case, told in answers.items()]
    changed = [(label, told) for label, told in pairs if (label["since_drive"] or 1) > 1]
    same = [(label, told) for label, told in pairs if (label["since_drive"] or 1) == 1]
    differ = [(label, told) for label, told in same if label["effects"]]
    inside = [
        t["since"] and t["earliest"] <= label["since_drive"] <= t["latest"] for label, t in changed
    ]
    mended = [
        t["mended"] == label.get("until_drive") for label, t in changed if label.get("until_drive")
    ]
    rows = {
        "alarm on a valve that does not change": [bool(told["since"]) for _, told in same],
        "first drive of a change within the interval": inside,
        "cause of a change": [told["what"] == label["effects"][0] for label, told in changed],
        "repair": mended,
        "cause from the start": [t["from the start"] == label["effects"][0] for label, t in differ],
    }
    return [[what, f"{sum(map(bool, true))} of {len(true)}"] for what, true in rows.items()]


def main(arguments: Sequence[str] | None = None) -> int:
    """Monitor what is missing, write the answers and print the scores; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("round", type=Path, help="folder of logs")
    parser.add_argument("--out", type=Path, required=True, help="folder of the work")
    options = parser.parse_args(arguments)
    cases = sorted(path.parent.name for path in options.round.glob("*/log.json"))
    if not cases:
        raise ValueError(f"{options.round} holds no logs: give the folder of a round of logs")
    work = options.out / options.round.name
    journal = Journal(work / "answers.jsonl", {"round": options.round.name, "learn": LEARN})
    for case in progress([case for case in cases if case not in journal], what="logs"):
        journal.add(case, answer(options.round / case, work / case))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({"case": case} | journal[case] for case in cases)
    write_text(FOLDER / f"{options.round.name}-monitor.csv", stream.getvalue())
    print(stream.getvalue())
    if (options.round / LABELS).exists():
        labels = json.loads((options.round / LABELS).read_text())
        print(table(("what", "count"), counts({case: journal[case] for case in cases}, labels)))
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
