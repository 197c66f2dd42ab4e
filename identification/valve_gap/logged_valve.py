"""An operation log for the diagnosis: openings at steady consumption, and the drives with each cause.

A log does not hold the consumption: each opening has a nuisance for the error of its estimate.
"""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.plantfile import Plant
from identification.gap.plant import NuisanceParameter
from identification.gap.prepare.screened import Finding
from identification.gap.search.onset import Span, in_span
from identification.recordings.log_files import Log, read_log
from identification.recordings.openings import (
    HELD_OUT_EVERY,
    drive_of,
    evenly,
    openings,
    pauses,
    start_of,
)
from identification.recordings.recording import OUTPUTS, Campaign, Recording, rules_of
from identification.replay.replay import FLOW_RAMP, FLOW_SHIFT
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


def logged_valve(
    folder: Path, plant: Plant, without: Sequence[str] = (), drives: int | None = None
) -> tuple[Log, "LoggedValve"]:
    """A log, or its first drives, and the valve for the diagnosis; see `diagnose_log`."""
    log = read_log(folder, rules_of(plant))
    log = replace(log, drives=log.drives[:drives])
    campaign, steady = steady_openings(log, plant)
    resting = pauses(log, plant.parameters)
    return log, LoggedValve(with_pauses(campaign, resting, log), plant, steady, without, resting)


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
