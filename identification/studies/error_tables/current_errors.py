"""What the printed errors of the current mean, without any cause: how much, where, and when.

Two readings. The residual's square, shared among the switchings, is compared with a step of the current:
how long would the model have to be wrong by all of it? And Table 11 beside Table 13: the same recordings
against two models whose difference is known, which tells how far each test's residual lies along it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects import COPPER
from epv_env.plant.parameters import Parameters
from identification.recordings.recording import OUTPUTS
from identification.replay.batch_simulation import Replay
from identification.studies.error_tables.bench_conditions import CASES, N_FITTED, Conditions
from identification.studies.error_tables.patterns import initial_ratio, printed_after
from identification.studies.error_tables.recalibration import STEP, SYMBOLS, vector

CURRENT = OUTPUTS.index("I")


@dataclass(frozen=True, kw_only=True)
class Residual:
    """The current's residual after calibration, by test, (5,)."""

    mean: NDArray
    """Mean current, by which eq. 19 divides [A]."""
    rms: NDArray
    """[A]."""
    edges: NDArray
    """Switchings of the coil."""
    per_edge: NDArray
    """Square of the residual times time, for each switching [A^2 s]."""
    step_time: NDArray
    """Time for which a switching would have to be wrong by the whole current [s]."""
    plateau: NDArray
    """The constant relative error of the holding current that would give as much [-]."""


@dataclass(frozen=True, kw_only=True)
class Winding:
    """What the step from Table 11 to Table 13 says of the winding in tests 1 to 4; (draws, 4)."""

    excess: NDArray
    """Relative current beyond the model's, of the kind that a colder winding gives [-]."""
    share: NDArray
    """Share of the current's squared error that it makes up [-]."""

    @property
    def warmth(self) -> NDArray:
        """Winding temperature relative to the tests' mean [K]."""
        return -self.excess / COPPER


def residual(conditions: Conditions) -> Residual:
    """The printed errors of I in other units."""
    drives = conditions.drives
    outputs = Replay(drives, Parameters.calibrated()).outputs(
        vector().values(np.ones((1, len(SYMBOLS))))
    )
    mean = np.array([np.mean(model[CURRENT, :, 0]) for model in outputs])
    rms = 0.01 * printed_after()[:, CURRENT] * mean
    edges = np.array([2 * len(case.openings) for case in CASES])
    duration = np.array([case.duration for case in conditions.cases])
    hold = conditions.U_on / Parameters.calibrated()["R"]
    on = np.array([np.mean(drive.U > 0) for drive in drives])
    per_edge = rms**2 * duration / edges
    return Residual(
        mean=mean, rms=rms, edges=edges, per_edge=per_edge, step_time=per_edge / hold**2,
        plateau=rms / np.sqrt(on) / hold,
    )  # fmt: skip


def winding(conditions: Sequence[Conditions], before: NDArray, after: NDArray) -> Winding:
    """How much of each test's residual is of the kind that a warmer or colder winding gives.

    Eq. 19 of one recording against the models of Tables 10 and 12: e11^2 - e13^2 = 2 <r, d> + <d, d>,
    with r the residual after and d the change of the model. <r, d> is read as the sum of what each
    test's winding gives and of what every switching gives alike; the windings' mean is what R absorbed.
    before, after: Tables 11 and 13 [%], (tests, outputs).
    """
    e11, e13 = (0.01 * cells[:N_FITTED, CURRENT] for cells in (before, after))
    excess, share = [], []
    for one in conditions:
        products, switching = _along_R(one), _switchings(one)
        goal = 0.5 * (e11**2 - e13**2 - products[:, 0])
        matrix = np.zeros((N_FITTED + 1, N_FITTED + 1))
        matrix[:-1, :-1], matrix[:-1, -1] = np.diag(products[:, 1]), switching
        matrix[-1, :-1] = products[:, 2]
        excess.append(np.linalg.solve(matrix, np.append(goal, 0.0))[:-1])
        share.append(excess[-1] ** 2 * products[:, 2] / e13**2)
    return Winding(excess=np.array(excess), share=np.array(share))


def _switchings(conditions: Conditions) -> NDArray:
    """Switchings over duration and squared mean current: how eq. 19 weighs them, (4,)."""
    found = residual(conditions)
    duration = np.array([case.duration for case in conditions.cases])
    return (found.edges / duration / (found.mean / found.mean[0]) ** 2)[:N_FITTED]


def _along_R(conditions: Conditions) -> NDArray:
    """By test: <d, d>, <g, d> and <g, g>, with g the effect of a relatively lower R, (4, 3)."""
    colder = np.where(np.array(SYMBOLS) == "R", 1.0 - STEP, 1.0)
    candidates = vector().values(np.stack([np.ones(len(SYMBOLS)), initial_ratio(), colder]))
    rows = []
    for model in Replay(conditions.drives[:N_FITTED], Parameters.calibrated()).outputs(candidates):
        after, before, cold = model[CURRENT].T / np.mean(model[CURRENT, :, 0])
        d, g = after - before, (cold - after) / STEP
        rows.append([np.mean(d * d), np.mean(g * d), np.mean(g * g)])
    return np.array(rows)
