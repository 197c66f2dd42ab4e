"""Operation logs for the diagnosis: openings at steady consumption, and the drive where a cause begins.

A log does not hold the consumption: each opening has a nuisance for the error of its estimate.
"""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import replace
from os import PathLike
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from epv_env.common.command_line import NextStep
from epv_env.common.files import Journal
from epv_env.plant.plantfile import Plant, load_plant
from identification.gap.diagnosis import Diagnosis, diagnose, recalibrated_by_seen_noise
from identification.gap.fit.fitting_problem import FitCache
from identification.gap.fit.gauss_newton import linearise
from identification.gap.judge.verdict import AMBIGUOUS, NO_GAP, UNKNOWN
from identification.gap.plant import NuisanceParameter
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.prepare.screened import Finding
from identification.gap.report.gap_json import write_results
from identification.gap.search.onset import least_squares_by_onset
from identification.gap.search.posterior import log_likelihoods
from identification.gap.search.screening import simulate_signatures
from identification.recordings.log_files import Log, read_log
from identification.recordings.openings import drive_of, evenly, openings, start_of
from identification.recordings.recording import OUTPUTS, Campaign, campaign_facts
from identification.recordings.rules import rules_of
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

    A cause may act from a later drive on: the search is done for each first drive.

    plant: plant file with the nominal parameters, None for the report's calibration. without: causes to
    leave out. more: makes further sections of the report. Finished fits are kept in `out` and taken up
    again. Raises CampaignError for a log that cannot be used, ValueError for an unknown cause or a plant
    file that is none.
    """
    began = perf_counter()
    described = load_plant(plant)
    log = read_log(folder, rules_of(described))
    campaign, steady = steady_openings(log, described)
    valve = LoggedValve(campaign, described, steady, without)
    journal = Journal(out / JOURNAL, subject(valve, without, {}))
    steps = steps_on_stderr(began) if report else lambda step: None
    cache = FitCache(valve, journal, steps)
    found = _from_its_drive(valve, seed, cache)
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


def _from_its_drive(valve: "LoggedValve", seed: int, cache: FitCache) -> Diagnosis:
    """The diagnosis with the causes acting from the most probable drive on."""
    chances = onset_probabilities(valve, cache)
    onset = int(np.argmax(chances))
    found = diagnose(valve.since(onset), seed=seed, cache=cache)
    if onset == 0 or found.conclusion.verdict == NO_GAP:
        return found
    return replace(found, onset=(valve.drives[onset], float(chances[onset])))


def onset_probabilities(valve: "LoggedValve", cache: FitCache) -> NDArray:
    """Probability of each first drive, (drives,), by the misfit that the best single cause leaves.

    That it acts from the first drive on is as probable before the data as all later drives together.
    """
    problem, base = recalibrated_by_seen_noise(prepared(valve), cache)
    runs = linearise(problem, [base], problem.fitted_runs)[0]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    names = [drive_of(problem.plant.runs[r].name) for r in problem.fitted_runs]
    drives = np.array([valve.drives.index(name) for name in names])
    squares = least_squares_by_onset(runs, signatures, drives)
    misfits = (squares / np.min(squares) - 1.0) * problem.readings / 2.0
    scores = log_likelihoods(misfits, problem.readings)
    scores[1:] -= np.log(max(len(squares) - 1, 1))
    return softmax(scores)


class LoggedValve(Valve):
    """`GreyBox` for an operation log: causes act from a drive on, parameters from the first one."""

    def __init__(
        self,
        campaign: Campaign,
        plant: Plant,
        steady: Collection[str],
        without: Sequence[str] = (),
    ):
        """campaign, steady: of `steady_openings`. See `Valve`."""
        super().__init__(campaign, plant, without=without, offsets=CONSUMPTION)
        for run in self.runs:
            p2 = run.trusted[OUTPUTS.index("p2")]
            # The controller opens the valve because this reading is low, by noise as often as not.
            p2[np.flatnonzero(np.diff(run.inputs["U"]) < 0.0) + 1] = False
            if run.name not in steady:  # p2 then follows from a consumption that nobody knows
                p2[:] = False
        self.screened = tuple(_in_drive(finding, campaign) for finding in self.screened)
        self.drives = list(dict.fromkeys(drive_of(r.name) for r in campaign.recordings))
        self.acting = np.ones(len(self.recordings), dtype=bool)
        kept = {p.symbol for p in self.parameters} | {t.symbol for t in self.tolerances}
        self.late = {p.symbol for cause in self.causes for p in cause.parameters} - kept

    def since(self, onset: int) -> "LoggedValve":
        """The same with causes that act from drive number `onset` on, counted from 0."""
        late = copy(self)
        late.acting = np.array([self.drives.index(drive_of(r.name)) >= onset for r in self.recordings])
        return late

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: per run an array (3, samples, n) of OUTPUTS [Pa, Pa, A]."""
        return super().outputs(self._since_onset(values), runs)

    def _one(self, values: Mapping[str, NDArray], run: int) -> dict[str, float]:
        return super()._one(self._since_onset(values), run)

    def _since_onset(self, values: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """Values by symbol with those of causes (n, runs), nominal in drives before the onset."""
        if np.all(self.acting):
            return dict(values)
        return {
            s: np.where(self.acting, v[:, None] if np.ndim(v) == 1 else v, self.base[s])
            if s in self.late
            else v
            for s, v in values.items()
        }


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
