"""The openings of a valve in an operation log, as recordings that the model can be compared with.

Consumption is not logged. While the valve is shut, the balance of the circuit gives it:
sigma_S = -V2/(R T) dp2/dt. Where it is steady before and after an opening, and the same, it is taken to
be steady during the opening, too. An opening begins with the coil on and every chamber at rest.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from epv_env.common.units import BAR, GRAM
from identification.noise import differences
from identification.recordings.log_files import LONGEST, Drive, Log
from identification.recordings.recording import CHANNELS, HOLD, Campaign, CampaignError, Recording

REST_RANGE, SETTLING = 0.1 * BAR, 0.01
"""Range of p3 within REST below which the control chamber is at rest [Pa], and how long it may still
settle within this range [s]: what is left falls to a third every 5 ms."""
REST = HOLD + SETTLING
"""Time at rest before an opening [s]."""

SHUT_BEFORE, SHUT_AFTER = 0.1, 0.1
"""Longest stretches with the valve shut that belong to an opening [s]."""

VENTING = 0.03
"""Time after the command in which p3 is still too high for the valve to open [s]."""

SAME_FLOW, DEVIATIONS = 0.2 * GRAM, 3.0
"""Consumption is the same before and after an opening if it differs by less than this [kg/s] and this
number of standard deviations [1] together."""

STRAIGHT = 1.5
"""Scatter of p2 about a straight line, relative to its noise, up to which consumption is steady [1]."""

OPENINGS_PER_DRIVE, DRIVES = 20, 12
"""Openings of a drive that are compared, evenly over the drive; of each drive of a log with more than
DRIVES fewer, so that it takes no longer."""

HELD_OUT_EVERY = 3
"""Every third opening is held out."""

PAUSE = 0.3
"""Length of a stretch with the valve shut in which consumption is read off p2 [s]: to 0.02 g/s."""

PAUSES_PER_DRIVE, LEAST_PAUSES = 4, 8
"""Pauses of a drive that are compared, and without which nothing says that consumption rests."""

REST_FLOW, APART = 0.02 * GRAM, 6.0
"""Level of the lowest readings of consumption up to which nothing is consumed [kg/s], and how far
apart these readings are, in standard deviations [1]."""

LEAST_OPENINGS = 6
"""Openings without which a log says too little."""


@dataclass(frozen=True)
class _Stretch:
    """Samples from `first` to before `end` around one opening, and the air consumed about it."""

    first: int
    end: int
    before: "_Flow"
    after: "_Flow"

    @property
    def flow(self) -> float:
        """Consumption on average [kg/s]."""
        each = (self.before, self.after)
        return float(np.average([f.value for f in each], weights=[1.0 / f.sd**2 for f in each]))

    @property
    def steady(self) -> bool:
        """Whether consumption is steady before and after it, and the same."""
        sd = np.hypot(self.before.sd, self.after.sd)
        same = abs(self.before.value - self.after.value) <= SAME_FLOW + DEVIATIONS * sd
        return bool(same) and self.before.scatter <= STRAIGHT and self.after.scatter <= STRAIGHT


@dataclass(frozen=True)
class _Flow:
    """Consumption while the valve is shut."""

    value: float
    """[kg/s]."""
    sd: float
    """Its standard deviation [kg/s]."""
    scatter: float
    """Scatter of p2 about a straight line, relative to its noise [1]."""


def openings(log: Log, p: Mapping[str, float]) -> tuple[Campaign, set[str]]:
    """Openings of all drives as a campaign, and the names of those at steady consumption.

    A recording's name holds its drive and the time at which it begins. p: V2 and R_gas by symbol [SI].
    Raises CampaignError where the log has too few openings.
    """
    storage = p["V2"] / (p["R_gas"] * log.temperature)
    recordings, steady = list[Recording](), set[str]()
    for drive in log.drives:
        for stretch in _stretches(drive, log.period, storage):
            recording = _recording(drive, stretch, log.period)
            recordings.append(recording)
            if stretch.steady:
                steady.add(recording.name)
    campaign = Campaign(
        name=log.name,
        temperature=log.temperature,
        pressure=log.pressure,
        recordings=tuple(recordings),
    )
    return _enough(campaign), steady


def evenly(campaign: Campaign, preferred: Collection[str]) -> Campaign:
    """At most OPENINGS_PER_DRIVE of a drive, those with the preferred names first; every third held out.

    Raises CampaignError where too few are left.
    """
    chosen: list[Recording] = []
    groups = groupby(campaign.recordings, key=lambda recording: drive_of(recording.name))
    every = [list(group) for _, group in groups]
    most = _of_each(OPENINGS_PER_DRIVE, len(every))
    for drive in every:
        first = _spread([r for r in drive if r.name in preferred], most)
        others = [r for r in drive if r.name not in preferred]
        first += _spread(others, most - len(first))
        chosen += sorted(first, key=lambda recording: start_of(recording.name))
    roles = ("calibration",) * (HELD_OUT_EVERY - 1) + ("validation",)
    recordings = tuple(
        replace(recording, role=roles[number % HELD_OUT_EVERY])
        for number, recording in enumerate(chosen)
    )
    return _enough(replace(campaign, recordings=recordings))


def pauses(log: Log, p: Mapping[str, float]) -> tuple[Recording, ...]:
    """Stretches with the valve shut in which nothing is consumed, as recordings with sigma_S = 0.

    Consumption is never negative: where p2 rises while the valve is shut, something leaks into it. The
    lowest readings of a drive, as far as noise scatters them, are taken for no consumption unless their
    level is above that. p: V2 and R_gas by symbol [SI].
    """
    storage, length = p["V2"] / (p["R_gas"] * log.temperature), round(PAUSE / log.period)
    recordings = list[Recording]()
    for drive in log.drives:
        at_rest = _at_rest(drive, log.period)
        ends = np.flatnonzero(np.diff(at_rest.astype(int), prepend=0, append=0)).reshape(-1, 2)
        starts = [i for first, end in ends for i in range(first, end - length + 1, length)]
        flows = [_flow(drive.p2[i : i + length], log.period, storage) for i in starts]
        straight = [(f, i) for f, i in zip(flows, starts, strict=True) if f.scatter <= STRAIGHT]
        low = min((f.value for f, _ in straight), default=0.0)
        lowest = [(f.value, i) for f, i in straight if f.value <= low + APART * f.sd]
        if len(lowest) < LEAST_PAUSES or np.median([value for value, _ in lowest]) > REST_FLOW:
            continue
        none = _Flow(0.0, 1.0, 1.0)
        resting = [_recording(drive, _Stretch(i, i + length, none, none), log.period) for _, i in lowest]
        recordings += _spread(resting, _of_each(PAUSES_PER_DRIVE, len(log.drives)))
    return tuple(recordings)


def _of_each(most: int, drives: int) -> int:
    """How many of the at most `most` of a drive are taken of each."""
    return max(most * DRIVES // max(drives, DRIVES), 1)


def _recording(drive: Drive, stretch: _Stretch, period: float) -> Recording:
    rows = slice(stretch.first, stretch.end)
    return Recording(
        name=f"{drive.file} at {stretch.first * period:.3f} s",
        role="calibration",
        period=period,
        sigma_S=np.full(stretch.end - stretch.first, stretch.flow),
        **{name: getattr(drive, name)[rows] for name in CHANNELS},
    )


def _spread(recordings: Sequence[Recording], most: int) -> list[Recording]:
    """At most a number of recordings, evenly over them."""
    count = min(len(recordings), most)
    return [recordings[k] for k in np.unique(np.linspace(0, len(recordings) - 1, count).astype(int))]


def _enough(campaign: Campaign) -> Campaign:
    if len(campaign.recordings) < LEAST_OPENINGS:
        raise CampaignError(
            f"{campaign.name}: {len(campaign.recordings)} openings can be compared, too few: log "
            f"at least {LEAST_OPENINGS}, from a valve shut for {REST * 1e3:g} ms, at steady consumption"
        )
    return campaign


def drive_of(recording: str) -> str:
    """File of the drive that the recording of an opening was cut from."""
    return recording.split(" ", 1)[0]


def start_of(recording: str) -> float:
    """Time at which the recording of an opening begins in its drive [s]."""
    return float(recording.split(" ")[-2])


def _stretches(drive: Drive, period: float, storage: float) -> Iterator[_Stretch]:
    """The openings of a drive; storage: V2/(R T) [kg/Pa]."""
    at_rest = _at_rest(drive, period)
    commands = np.flatnonzero(np.diff(drive.coil) < 0.0) + 1
    for i in commands:
        if at_rest[i - 1]:
            stretch = _stretch(drive, int(i), commands, at_rest, period, storage)
            if stretch is not None:
                yield stretch


def _at_rest(drive: Drive, period: float) -> NDArray:
    """Whether the coil has been on and p3 constant for REST, up to each sample; boolean (samples,)."""
    hold = round(REST / period)
    if len(drive.coil) < hold:
        return np.zeros(len(drive.coil), dtype=bool)
    on = np.all(sliding_window_view(drive.coil, hold) > 0.0, axis=1)
    flat = np.ptp(sliding_window_view(drive.p3, hold), axis=1) < REST_RANGE
    return np.concatenate([np.zeros(hold - 1, dtype=bool), on & flat])


def _stretch(
    drive: Drive, i: int, commands: NDArray, at_rest: NDArray, period: float, storage: float
) -> _Stretch | None:
    """The opening whose command is sample i; None where it does not end."""
    hold, venting = round(REST / period), round(VENTING / period)
    rest = i - int(np.argmin(at_rest[:i][::-1])) - (hold - 1)  # p3 has been constant since then
    first = max(rest + round(SETTLING / period), i - round(SHUT_BEFORE / period), 0)
    shut = np.flatnonzero(at_rest[i : i + round(LONGEST / period)])
    if not shut.size:
        return None
    again = i + int(shut[0]) - (hold - 1)
    later = commands[commands > again]
    limit = later[0] + venting if later.size else len(drive.coil)
    end = min(again + hold + round(SHUT_AFTER / period), limit, len(drive.coil))
    before = _flow(drive.p2[first : i + venting], period, storage)
    after = _flow(drive.p2[again:end], period, storage)
    return _Stretch(first, end, before, after)


def _flow(p2: NDArray, period: float, storage: float) -> _Flow:
    """Air consumed while the valve is shut; p2: (samples,) [Pa], storage: V2/(R T) [kg/Pa]."""
    centred = (np.arange(len(p2)) - 0.5 * (len(p2) - 1)) * period
    spread = np.sum(centred**2)
    slope = float(centred @ p2 / spread)
    noise = float(np.std(differences(p2, 1))) + 1.0
    rest = float(np.std(p2 - slope * centred))
    return _Flow(-storage * slope, storage * noise / float(np.sqrt(spread)), rest / noise)
