"""What is done to a valve over time, as pieces between which the inputs are constant."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """A valve, its state at time 0, and inputs that hold from one border to the next. SI units."""

    parameters: Parameters
    initial: State
    borders: NDArray
    """Times at which inputs change [s], from 0 to the end of the run, shape (segments + 1,)."""
    inputs: Inputs
    """One value per segment, shape (segments,)."""
    reservoir_volume: float = np.inf
    """Volume that feeds the input chamber [m^3]; infinite: p1 follows its inputs alone."""

    @property
    def duration(self) -> float:
        """Length of the run [s]."""
        return float(self.borders[-1])


def piecewise_schedule(
    parameters: Parameters,
    initial: State,
    borders: ArrayLike,
    *,
    U: ArrayLike,
    sigma_S: ArrayLike = 0.0,
    p1_slope: ArrayLike = 0.0,
    refill: ArrayLike = 0.0,
    reservoir_volume: float = np.inf,
) -> Schedule:
    """A Schedule; scalars hold throughout, and borders between equal inputs are dropped.

    Args:
        borders: times [s], (segments + 1,), from 0 to the end of the run.
        U: coil voltage [V], () or (segments,).
        sigma_S: air consumed from the circuit [kg/s], () or (segments,).
        p1_slope: rate of the supply pressure [Pa/s], () or (segments,).
        refill: air fed to the reservoir [kg/s], () or (segments,).
        reservoir_volume: [m^3].
    """
    times = np.asarray(borders, dtype=float)
    rows = np.stack(
        np.broadcast_arrays(*np.atleast_1d(U, sigma_S, p1_slope, refill), times[:-1])[:4]
    ).astype(float)
    changes = np.concatenate([[True], np.any(np.diff(rows, axis=1) != 0, axis=0)])
    return Schedule(
        parameters=parameters,
        initial=initial,
        borders=np.append(times[:-1][changes], times[-1]),
        inputs=Inputs(*rows[:, changes], *np.zeros((len(Inputs._fields) - 4, np.sum(changes)))),
        reservoir_volume=reservoir_volume,
    )


def delayed_schedule(schedule: Schedule, delay: float) -> Schedule:
    """The schedule with every change of its inputs but the first later by `delay` [s].

    Only the voltage may change: inputs that act at once have no place in a delayed schedule.
    """
    if delay == 0 or len(schedule.borders) == 2:
        return schedule
    end = schedule.duration
    borders = np.concatenate([[0.0], np.minimum(schedule.borders[1:-1] + delay, end), [end]])
    return replace(schedule, borders=borders)
