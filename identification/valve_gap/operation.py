"""The diagnosis of an operation log: each cause acts in its drives."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from itertools import combinations
from os import PathLike
from pathlib import Path
from time import perf_counter

import numpy as np

from epv_env.common.command_line import NextStep
from epv_env.common.files import Journal
from epv_env.common.units import BAR
from epv_env.plant.plantfile import load_plant
from identification.gap.diagnosis import Diagnosis, diagnose, recalibrated_by_seen_noise
from identification.gap.fit.fitting_problem import FitCache, FittingProblem
from identification.gap.fit.gauss_newton import fit, linearise
from identification.gap.fit.recalibration import restarted
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.judge.verdict import AMBIGUOUS, UNKNOWN
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.gap_json import write_results
from identification.gap.search.onset import LinearisedLog, Span, likeliest_span, spans_of_causes
from identification.gap.search.screening import CauseSignature, simulate_signatures
from identification.gap.search.separability import assess_separability
from identification.recordings.openings import drive_of
from identification.valve_gap.diagnose import (
    JOURNAL,
    More,
    steps_on_stderr,
    subject,
    write_report,
)
from identification.valve_gap.diagnose import next_step as after_diagnosis
from identification.valve_gap.logged_valve import CONSUMPTION, LoggedValve, logged_valve


def diagnose_log(
    folder: Path,
    out: Path,
    *,
    plant: str | PathLike[str] | None = None,
    without: Sequence[str] = (),
    seed: int = 0,
    report: bool = True,
    more: More | None = None,
    drives: int | None = None,
) -> Diagnosis:
    """Diagnose an operation log; write gap.json, and unless `report` is False report and plant file.

    Each cause acts in its most probable drives: from a later one on, or until it is mended.

    plant: plant file with the nominal parameters, None for the report's calibration. without: causes to
    leave out. more: makes further sections of the report. drives: how many, from the first one on; None
    for all. Finished fits are kept in `out` and taken up again. Raises CampaignError for a log that
    cannot be used, ValueError for an unknown cause or a plant file that is none.
    """
    began = perf_counter()
    log, valve = logged_valve(folder, load_plant(plant), without, drives)
    journal = Journal(out / JOURNAL, subject(valve, without, {}))
    steps = steps_on_stderr(began) if report else lambda step: None
    cache = FitCache(valve, journal, steps)
    found = _in_its_drives(valve, seed, cache)
    found = replace(found, warnings=[*valve.warnings, *found.warnings])
    if report:
        step = next_step(found.conclusion.verdict, folder, out, Path(plant) if plant else None)
        facts = {
            "Log": log.name,
            "Recordings": f"{len(valve.recordings)}, of {len(log.drives)} drives",
            "Environment": f"{log.temperature:g} K, {log.pressure / BAR:g} bar",
        }
        write_report(found, valve, out, log.name, facts, step, more=more)
    write_results(found, out, "", seconds=perf_counter() - began)
    return found


def next_step(verdict: str, folder: Path, out: Path, plant: Path | None) -> NextStep:
    """What to run after the diagnosis of a log; see `diagnose.next_step`."""
    if verdict in (AMBIGUOUS, UNKNOWN):
        return NextStep("once more drives are logged", ("gap", folder, "--logs", "--out", out), plant)
    return after_diagnosis(verdict, folder, out, plant)


def predicted(valve: LoggedValve, cache: FitCache) -> LinearisedLog:
    """The first step of the diagnosis of a log."""
    problem, base = recalibrated_by_seen_noise(prepared(valve), cache)
    runs = linearise(problem, [base], problem.fitted_runs)[0]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    drives = [drive_of(problem.plant.runs[r].name) for r in problem.fitted_runs]
    numbers = np.array([valve.drives.index(drive) for drive in drives])
    count = len(valve.drives)
    return LinearisedLog(runs, signatures, numbers, count, problem.readings, valve.lasting)


def _in_its_drives(valve: LoggedValve, seed: int, cache: FitCache) -> Diagnosis:
    """The diagnosis with each cause acting in its most probable drives."""
    first = predicted(valve, cache)
    spans = spans_of_causes(first)
    found = diagnose(valve.acting_in(spans), seed=seed, cache=cache)
    if found.best and len(found.best.hypothesis.labels) == 1:
        (label,) = found.best.hypothesis.labels
        refitted = spans | {label: _span_by_refits(valve, spans, found)}
        if (refitted[label].first, refitted[label].end) != (spans[label].first, spans[label].end):
            cache = cache.named("in its drives: ")
            found = diagnose(valve.acting_in(refitted), seed=seed, cache=cache)
        spans = refitted
    onsets = {label: span.onset(valve.drives) for label, span in spans.items()}
    hidden = set(found.ranking.separability.absorbed)
    return replace(
        found,
        onsets={label: onset for label, onset in onsets.items() if onset},
        as_consumption=tuple(c for c in as_consumption(first.runs, first.signatures) if c in hidden),
    )


def _span_by_refits(valve: LoggedValve, spans: Mapping[str, Span], found: Diagnosis) -> Span:
    """The likeliest drives of the best cause, which is a single one, by a fit in each of some spans.

    These are all that last to the end, then those that begin with the best of them: as many as drives.
    """
    problem, estimate = found.ranking.problem, found.best.hypothesis.estimate  # type: ignore[union-attr]
    (cause,) = estimate.hypothesis.causes
    if cause.label in valve.lasting and not cause.run_parameters:
        return spans[cause.label]  # a parameter off its value
    count = len(valve.drives)
    squares = dict.fromkeys(combinations(range(count + 1), 2), np.inf)

    def refit(span: tuple[int, int]) -> None:
        plant = copy(prepared(problem.plant))
        plant.plant = valve.acting_in({**spans, cause.label: Span(*span, 1.0, False, span)})
        narrowed = FittingProblem(plant, problem.slopes)
        squares[span] = fit(narrowed, [restarted(estimate)], iterations=3)[0].chi_square

    for start in range(count):
        refit((start, count))
    first, _ = min(squares, key=lambda span: squares[span])
    for end in range(first + 1, count):
        refit((first, end))
    return likeliest_span(np.array([*squares.values()]), [*squares], count, problem.readings)


def as_consumption(
    runs: Sequence[LinearisedRun], signatures: Sequence[CauseSignature]
) -> tuple[str, ...]:
    """Labels of causes that would show if consumption were known, and that the unknown one absorbs.

    runs: the model without a cause, linearised. signatures: of the causes beside it.
    """
    of_consumption = slice(-len(CONSUMPTION), None)  # offsets are the last nuisances of a run
    known = [replace(run, run_slopes=run.run_slopes.copy()) for run in runs]
    for run in known:
        run.run_slopes[:, of_consumption] = 0.0
    absorbed, still = (assess_separability(each, signatures).absorbed for each in (runs, known))
    return tuple(label for label in absorbed if label not in still)
