"""A valve that is followed by its log: learnt from the first drives, then watched.

The judgement is that of the log's diagnosis. Its nominal plant is the valve as learnt; its first step, a
linear prediction, says within seconds whether the rest is worth while.
"""

from dataclasses import dataclass
from pathlib import Path

from epv_env.plant.plantfile import load_plant
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.fitting_problem import FitCache
from identification.gap.search.onset import gain_by_change
from identification.recordings.log_files import Log
from identification.valve_gap.diagnose import PLANT
from identification.valve_gap.logged_valve import LoggedValve, logged_valve
from identification.valve_gap.operation import diagnose_log, predicted

LEARNT = "learnt"
"""Folder of the first drives' diagnosis; that of all is named after the last drive."""
IN_SIGHT = 1.0
"""Gain by a change up to which it may be chance [tolerated misfits]."""


@dataclass(frozen=True, kw_only=True)
class Monitored:
    """What a log says of a valve."""

    log: Log
    learnt: Diagnosis | None
    """Of the first drives; None where the valve was given."""
    found: Diagnosis | None
    """Of all drives; None where they are as the valve was learnt."""


def monitor_log(
    folder: Path, out: Path, *, plant: Path | None = None, learn: int, seed: int = 0
) -> Monitored:
    """Learn the valve of a log, and find its changes.

    A valve that changes while it is learnt is no reference: then learning and watching are one diagnosis
    of all drives.

    plant: plant file from which learning begins, None for the report's calibration; of the valve itself
    where nothing is learnt. learn: how many drives, 0 for none. Pages of the diagnoses and finished fits
    are kept in `out`. Raises as `diagnose_log`.
    """
    learnt, reference = None, plant
    if learn:
        learnt = diagnose_log(folder, out / LEARNT, plant=plant, seed=seed, drives=learn)
        reference = plant if learnt.onset else out / LEARNT / PLANT
    log, valve = logged_valve(folder, load_plant(reference))
    if len(log.drives) <= learn:
        return Monitored(log=log, learnt=learnt, found=learnt)
    if not (learnt and learnt.onset) and gain_in(valve, known=not learnt) < IN_SIGHT:
        return Monitored(log=log, learnt=learnt, found=None)
    own = out / Path(log.drives[-1].file).stem
    found = diagnose_log(folder, own, plant=reference, seed=seed)
    return Monitored(log=log, learnt=learnt, found=found)


def gain_in(valve: LoggedValve, known: bool) -> float:
    """By how much a change betters the nominal plant [tolerated misfits]; known: of `gain_by_change`."""
    return gain_by_change(predicted(valve, FitCache(valve)), known)
