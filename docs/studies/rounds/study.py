"""Whether the proposed recording is worth it: rounds of experiments with it and with random programmes.

    python -m docs.studies.rounds.study

draws valves with one cause, records three programmes of each on the virtual bench, and lets both ways of
choosing add up to two recordings. trials.jsonl keeps each trial; what is there is not run again.
"""

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import COUNT, fail_clearly
from epv_env.common.files import Journal
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from identification.bench.programmes import DIAGNOSIS_SUITE, Programme
from identification.bench.session import run_bench
from identification.blind.truth import EFFECTS, ONE_CAUSE, draw_trial
from identification.gap.verdict import NO_GAP, UNKNOWN
from identification.recordings.campaign_files import write_campaign
from identification.valve_gap.diagnose import diagnose_campaign
from identification.valve_gap.programmes import CANDIDATES
from identification.valve_gap.rounds import Bench, Round, certain, rounds

FOLDER = Path(__file__).parent
SEED = 4901
TRIALS, MOST = 16, 2
WAYS = ("proposed", "random")
FIRST = ("test1", "test2", "validation")
"""Programmes of the first campaign; the last is held out."""


def trial(number: int) -> dict[str, list[dict[str, Any]]]:
    """Each way's rounds of one trial; only the first round where its answer is certain."""
    rng = np.random.default_rng([SEED, number])
    cause = EFFECTS[int(rng.integers(len(EFFECTS)))]
    truth = draw_trial(SEED, number, ONE_CAUSE, (cause,)).parameters
    suite = [programme for programme in DIAGNOSIS_SUITE if programme.name in FIRST]
    bench = Bench(truth=Plant(parameters=truth, region=Region(centre=truth)), seed=number)
    with TemporaryDirectory() as name:
        folder = Path(name)
        first = folder / "campaign"
        write_campaign(run_bench(suite, truth, seed=SEED + number), first)
        ran = rounds(first, folder / "proposed", MOST, bench, diagnose_campaign)
        begun = next(ran)
        if certain(begun.found):
            return {way: [outcome(begun, cause)] for way in WAYS}
        copytree(folder / "proposed", folder / "random")  # its fits are taken up
        without_report = partial(diagnose_campaign, report=False)
        other = rounds(first, folder / "random", MOST, bench, without_report, lambda out: any_of(rng))
        return {
            "proposed": [outcome(each, cause) for each in (begun, *ran)],
            "random": [outcome(each, cause) for each in other],
        }


def any_of(rng: np.random.Generator) -> Programme:
    """A random feasible programme."""
    return CANDIDATES[int(rng.integers(len(CANDIDATES)))]


def outcome(each: Round, cause: str) -> dict[str, Any]:
    """What a round answered, and whether that is right."""
    found = each.found
    best = found.conclusion.causes[0]
    return {
        "cause": cause,
        "added": each.added,
        "verdict": found.conclusion.verdict,
        "first": list(best.effects),
        "probability": round(best.probability, 4),
        "no_cause": round(found.ranking.no_cause, 4),
        "certain": certain(found),
        "right": best.effects == (cause,) and found.conclusion.verdict not in (NO_GAP, UNKNOWN),
    }


def rows(trials: Sequence[dict[str, list[dict[str, Any]]]]) -> list[list[str]]:
    """Of each way, over the trials that were not certain at once."""
    unsure = [each for each in trials if not each["proposed"][0]["certain"]]
    found = []
    for way in WAYS:
        own = [each[way] for each in unsure]
        settled = [each[-1]["added"] for each in own if each[-1]["certain"]]
        found.append(
            [
                way,
                f"{sum(each[0]['right'] for each in own)} of {len(own)}",
                f"{sum(each[-1]['right'] for each in own)} of {len(own)}",
                f"{len(settled)} of {len(own)}",
                f"{sum(settled) + (MOST + 1) * (len(own) - len(settled))}",
                f"{sum(each[-1]['certain'] and not each[-1]['right'] for each in own)}",
            ]
        )
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--trials", type=COUNT, default=TRIALS)
    options = study_options(parser, arguments)
    journal = Journal(options.out / "trials.jsonl", {"seed": SEED, "first": list(FIRST), "most": MOST})
    names = [str(number) for number in range(1 if options.quick else options.trials)]
    for name in names:
        if name not in journal:
            journal.add(name, trial(int(name)))
            print(name, journal[name], flush=True)
    headings = [
        "Programme", "First cause right before", "After", "One answer at 95 %",
        f"Recordings, {MOST + 1} where none held 95 %", "Certain and wrong",
    ]  # fmt: skip
    fill(options.out / PAGE, {"figures": table(headings, rows([journal[name] for name in names]))})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
