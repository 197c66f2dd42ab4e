"""Operation logs for the diagnosis: openings at steady consumption, and the drives with each cause.

A log does not hold the consumption: each opening has a nuisance for the error of its estimate.
"""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import replace
from itertools import combinations
from os import PathLike
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from epv_env.common.command_line import NextStep
from epv_env.common.files import Journal
from epv_env.plant.plantfile import Plant, load_plant
from identification.gap.diagnosis import Diagnosis, diagnose, recalibrated_by_seen_noise
from identification.gap.fit.fitting_problem import FitCache, FittingProblem
from identification.gap.fit.gauss_newton import fit, linearise
from identification.gap.fit.recalibration import restarted
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.judge.verdict import AMBIGUOUS, UNKNOWN
from identification.gap.plant import NuisanceParameter
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.prepare.screened import Finding
from identification.gap.report.gap_json import write_results
from identification.gap.search.onset import Span, in_span, likeliest_span, spans_of_causes
from identification.gap.search.screening import CauseSignature, simulate_signatures
from identification.gap.search.separability import assess_separability
from identification.recordings.log_files import Log, read_log
from identification.recordings.openings import (
    HELD_OUT_EVERY,
    drive_of,
    evenly,
    openings,
    pauses,
    start_of,
)
from identification.recordings.recording import OUTPUTS, Campaign, Recording, campaign_facts, rules_of
from identification.replay.replay import FLOW_RAMP, FLOW_SHIFT
from identification.valve_gap.diagnose import (
    JOURNAL,
    More,
    steps_on_stderr,
    subject,
    write_report,
)
from identification.valve_gap.diagnose import next_step as after_diagnosis
from identification.valve_gap.valve import Valve

CONSUMPTION = (
    NuisanceParameter(symbol=FLOW_SHIFT, sd=3e-4, step=1e-4),
    NuisanceParameter(symbol=FLOW_RAMP, sd=6e-4, step=1e-4),
)
"""Error of a consumption that was read off p2, and its change during an opening [kg/s]."""

RESTING = 1.0 / 30.0
"""Error of the consumption where nothing is consumed, relative to CONSUMPTION [1]: 0.01 g/s."""

CHANGED_CONSUMPTION = 1.5
"""Misfit of p2 relative to that of the better openings of a drive (their lower quartile) beyond which
consumption jumped in an opening [1]. A cause acts in every opening of a drive, a consumer in a few."""


def diagnose_log(
    folder: Path,
    out: Path,
    *,
    plant: str | PathLike[str] | None = None,
    without: Sequence[str] = (),
    seed: int = 0,
    report: bool = True,
    more: More | None = None,
) -> Diagnosis:
    """Diagnose an operation log; write gap.json, and unless `report` is False report and plant file.

    Each cause acts in its most probable drives: from a later one on, or until it is mended.

    plant: plant file with the nominal parameters, None for the report's calibration. without: causes to
    leave out. more: makes further sections of the report. Finished fits are kept in `out` and taken up
    again. Raises CampaignError for a log that cannot be used, ValueError for an unknown cause or a plant
    file that is none.
    """
    began = perf_counter()
    described = load_plant(plant)
    log = read_log(folder, rules_of(described))
    campaign, steady = steady_openings(log, described)
    resting = pauses(log, described.parameters)
    valve = LoggedValve(with_pauses(campaign, resting, log), described, steady, without, resting)
    journal = Journal(out / JOURNAL, subject(valve, without, {}))
    steps = steps_on_stderr(began) if report else lambda step: None
    cache = FitCache(valve, journal, steps)
    found = _in_its_drives(valve, seed, cache)
    found = replace(found, warnings=[*valve.warnings, *found.warnings])
    if report:
        step = next_step(found.conclusion.verdict, folder, out, Path(plant) if plant else None)
        facts = {
            "Log": log.name,
            "Openings": f"{len(campaign.recordings)} of {len(log.drives)} drives",
            "Environment": campaign_facts(campaign)["Environment"],
        }
        write_report(found, valve, out, log.name, facts, step, more=more)
    write_results(found, out, "", seconds=perf_counter() - began)
    return found


def next_step(verdict: str, folder: Path, out: Path, plant: Path | None) -> NextStep:
    """What to run after the diagnosis of a log; see `diagnose.next_step`."""
    if verdict in (AMBIGUOUS, UNKNOWN):
        return NextStep("once more drives are logged", ("gap", folder, "--logs", "--out", out), plant)
    return after_diagnosis(verdict, folder, out, plant)


def _in_its_drives(valve: "LoggedValve", seed: int, cache: FitCache) -> Diagnosis:
    """The diagnosis with each cause acting in its most probable drives."""
    problem, base = recalibrated_by_seen_noise(prepared(valve), cache)
    runs = linearise(problem, [base], problem.fitted_runs)[0]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    drives = [drive_of(problem.plant.runs[r].name) for r in problem.fitted_runs]
    numbers = np.array([valve.drives.index(drive) for drive in drives])
    spans = spans_of_causes(
        runs, signatures, numbers, len(valve.drives), problem.readings, valve.lasting
    )
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
        as_consumption=tuple(c for c in as_consumption(runs, signatures) if c in hidden),
    )


def _span_by_refits(valve: "LoggedValve", spans: Mapping[str, Span], found: Diagnosis) -> Span:
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


class LoggedValve(Valve):
    """`GreyBox` for an operation log: each cause acts in its drives, parameters in all."""

    def __init__(
        self,
        campaign: Campaign,
        plant: Plant,
        steady: Collection[str],
        without: Sequence[str] = (),
        resting: Sequence[Recording] = (),
    ):
        """campaign, steady: of `steady_openings`. resting: recordings of `pauses`. See `Valve`."""
        super().__init__(campaign, plant, without=without, offsets=CONSUMPTION)
        known = {recording.name for recording in resting}
        self.doubt = np.array([RESTING if run.name in known else 1.0 for run in self.runs])
        """Error of the consumption in each run, relative to CONSUMPTION, (runs,) [1]."""
        for run in self.runs:
            p2 = run.trusted[OUTPUTS.index("p2")]
            # The controller opens the valve because this reading is low, by noise as often as not.
            p2[np.flatnonzero(np.diff(run.inputs["U"]) < 0.0) + 1] = False
            if run.name not in known.union(
                steady
            ):  # p2 then follows from a consumption that nobody knows
                p2[:] = False
        self.screened = tuple(_in_drive(finding, campaign) for finding in self.screened)
        self.drives = list(dict.fromkeys(drive_of(r.name) for r in campaign.recordings))
        kept = {p.symbol for p in self.parameters} | {t.symbol for t in self.tolerances}
        self.lasting = {
            cause.label
            for cause in self.causes
            if cause.run_parameters or kept & {p.symbol for p in cause.parameters}
        }
        """Labels of causes that act in all drives: parameters off their values, and causes whose state
        at the start of each opening is fitted, for which a linear prediction does not hold."""
        self.acting: dict[str, NDArray] = {}
        """In which runs a cause acts that does not act in all, boolean (runs,), by symbol."""

    def acting_in(self, spans: Mapping[str, Span]) -> "LoggedValve":
        """The same with causes, by label, that act in some drives only."""
        other = copy(self)
        drives = np.array([self.drives.index(drive_of(r.name)) for r in self.recordings])
        other.acting = {
            p.symbol: in_span(drives, spans[cause.label].first, spans[cause.label].end)
            for cause in self.causes
            for p in (*cause.parameters, *cause.run_parameters)
            if not spans[cause.label].whole
        }
        return other

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: per run an array (3, samples, n) of OUTPUTS [Pa, Pa, A]."""
        return super().outputs(self._where_acting(values), runs)

    def one(self, values: Mapping[str, NDArray], run: int) -> dict[str, float]:
        """Plant parameters of the first candidate in a run [SI]."""
        return super().one(self._where_acting(values), run)

    def _where_acting(self, values: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """Values by symbol, those of causes nominal in drives without them, consumption as doubted."""
        found = dict(values)
        for symbol, value in values.items():
            by_run = value[:, None] if np.ndim(value) == 1 else value
            if symbol in self.acting:
                found[symbol] = np.where(self.acting[symbol], by_run, self.base[symbol])
            elif symbol in (FLOW_SHIFT, FLOW_RAMP):
                found[symbol] = by_run * self.doubt
        return found


def _in_drive(finding: Finding, campaign: Campaign) -> Finding:
    """The finding with the drive's file and samples instead of the opening's."""
    opening = finding.file.removesuffix(".csv")
    first = round(start_of(opening) / campaign.recordings[0].period)
    samples = tuple(first + sample for sample in finding.samples)
    return replace(finding, file=drive_of(opening), samples=samples)


def steady_openings(log: Log, plant: Plant) -> tuple[Campaign, set[str]]:
    """Openings of a log, and the names of those in which consumption is steady.

    Raises CampaignError where there are too few openings.
    """
    campaign, steady = openings(log, plant.parameters)
    valve = Valve(campaign, plant, offsets=CONSUMPTION)
    misfits = dict(zip((run.name for run in valve.runs), _misfits(valve), strict=True))
    for drive in log.drives:
        own = {name for name in steady if drive_of(name) == drive.file}
        usual = np.quantile([misfits[name] for name in own] or [0.0], 0.25)
        steady -= {name for name in own if misfits[name] > CHANGED_CONSUMPTION * usual}
    return evenly(campaign, steady), steady


def with_pauses(campaign: Campaign, resting: Sequence[Recording], log: Log) -> Campaign:
    """The campaign of a log with recordings of `pauses`, every third held out, drives in order."""
    roles = ("calibration",) * (HELD_OUT_EVERY - 1) + ("validation",)
    more = [replace(r, role=roles[number % HELD_OUT_EVERY]) for number, r in enumerate(resting)]
    place = {drive.file: number for number, drive in enumerate(log.drives)}
    every = sorted([*campaign.recordings, *more], key=lambda r: place[drive_of(r.name)])
    return replace(campaign, recordings=tuple(every))


def _misfits(valve: Valve) -> NDArray:
    """Misfit of p2 in each run beyond its start and consumption, root mean square [SI], (runs,)."""
    n = len(valve.runs)
    shifts = {each.symbol: np.zeros((3, n)) for each in CONSUMPTION}
    for row, each in enumerate(CONSUMPTION, start=1):
        shifts[each.symbol][row] = each.step
    found = valve.outputs(shifts, range(n))
    row, rest = OUTPUTS.index("p2"), np.zeros(n)
    for run, output in enumerate(found):
        model = output[row, :, 0]
        basis = np.column_stack([output[row, :, 1:] - model[:, None], np.ones(len(model))])
        error = valve.runs[run].measured[row] - model
        rest[run] = np.std(error - basis @ np.linalg.lstsq(basis, error, rcond=None)[0])
    return rest
