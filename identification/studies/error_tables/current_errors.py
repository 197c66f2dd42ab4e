"""What the printed errors of the current say without any assumed cause: how large, where, and when.

Two readings. First, the residual's square is shared among the switchings and compared with a step of
the current: for how long would the model have to be wrong by the whole current? Second, Tables 11 and 13
compare the same recordings with two models whose difference is known. This tells how much of each test's
residual lies along this difference.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.coil import COPPER
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.recordings.recording import OUTPUTS
from identification.replay.batch_simulation import Replay
from identification.studies.error_tables.bench_conditions import CASES, N_FITTED, Conditions
from identification.studies.error_tables.error_prediction import (
    initial_guess_ratio,
    printed_calibrated_errors,
)
from identification.studies.error_tables.recalibration import calibrated_vector
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings

CURRENT_INDEX = OUTPUTS.index("I")


@dataclass(frozen=True, kw_only=True)
class CurrentResidual:
    """The current's residual after calibration by test; the fields are those of tables.json."""

    mean: NDArray
    """Mean current, by which eq. 19 divides [A], (5,)."""
    rms: NDArray
    """Root mean square of the residual [A], (5,)."""
    edges: NDArray
    """Switchings of the coil [-], (5,)."""
    per_edge: NDArray
    """Square of the residual times time for each switching [A^2 s], (5,)."""
    step_time: NDArray
    """Time for which each switching would have to be wrong by the whole current [s], (5,)."""
    plateau: NDArray
    """Constant relative error of the holding current that would give the same error [-], (5,)."""


@dataclass(frozen=True, kw_only=True)
class WindingContribution:
    """What the step from Table 11 to Table 13 says of the winding in tests 1 to 4; D sets of
    conditions."""

    excess: NDArray
    """Relative current beyond the model's of the kind that a colder winding gives [-], (D, 4)."""
    share: NDArray
    """Share of the current's squared error that this excess makes up [-], (D, 4)."""

    @property
    def temperature(self) -> NDArray:
        """Winding temperature less the tests' mean [K], (D, 4)."""
        return -self.excess / COPPER


def current_residual(conditions: Conditions) -> CurrentResidual:
    """The printed errors of I in other units, under given conditions."""
    drives = conditions.drives
    nominal = calibrated_vector().values(np.ones((1, len(CALIBRATED_SYMBOLS))))
    outputs = Replay(drives, Parameters.calibrated()).outputs(nominal)
    mean = np.array([np.mean(model[CURRENT_INDEX, :, 0]) for model in outputs])
    rms = 0.01 * printed_calibrated_errors()[:, CURRENT_INDEX] * mean
    edges = np.array([2 * len(case.openings) for case in CASES])
    duration = np.array([case.duration for case in conditions.cases])
    holding = conditions.U_on / Parameters.calibrated()["R"]
    energised = np.array([np.mean(drive.U > 0) for drive in drives])
    per_edge = rms**2 * duration / edges
    return CurrentResidual(
        mean=mean,
        rms=rms,
        edges=edges,
        per_edge=per_edge,
        step_time=per_edge / holding**2,
        plateau=rms / np.sqrt(energised) / holding,
    )


def winding_contribution(
    conditions: Sequence[Conditions],
    initial: NDArray,
    calibrated: NDArray,
    settings: ErrorTableSettings = DEFAULTS,
) -> WindingContribution:
    """How much of each test's residual is of the kind that a warmer or colder winding gives.

    Eq. 19 of one recording against the models of Tables 10 and 12: e11^2 - e13^2 = 2 <r, d> + <d, d>,
    with r the residual after calibration and d the change of the model. <r, d> is read as the sum of
    what each test's winding gives and of what every switching gives alike. R absorbs the windings' mean.

    Args:
        conditions: the D sets of test conditions.
        initial: Table 11 [%], (4 tests, 3 outputs).
        calibrated: Tables 13 and 15 [%], (5 tests, 3 outputs).
        settings: step of the finite difference.
    """
    e11, e13 = (0.01 * cells[:N_FITTED, CURRENT_INDEX] for cells in (initial, calibrated))
    excess, share = [], []
    for one in conditions:
        products, switching = _products_along_R(one, settings), _switching_weights(one)
        goal = 0.5 * (e11**2 - e13**2 - products[:, 0])
        matrix = np.zeros((N_FITTED + 1, N_FITTED + 1))
        matrix[:-1, :-1], matrix[:-1, -1] = np.diag(products[:, 1]), switching
        matrix[-1, :-1] = products[:, 2]
        excess.append(np.linalg.solve(matrix, np.append(goal, 0.0))[:-1])
        share.append(excess[-1] ** 2 * products[:, 2] / e13**2)
    return WindingContribution(excess=np.array(excess), share=np.array(share))


def _switching_weights(conditions: Conditions) -> NDArray:
    """Switchings over duration and squared relative mean current, as eq. 19 weighs them [1/s], (4,)."""
    residual = current_residual(conditions)
    duration = np.array([case.duration for case in conditions.cases])
    return (residual.edges / duration / (residual.mean / residual.mean[0]) ** 2)[:N_FITTED]


def _products_along_R(conditions: Conditions, settings: ErrorTableSettings) -> NDArray:
    """By test: <d, d>, <g, d> and <g, g> [-], with g the effect of a relatively lower R, (4, 3)."""
    step = settings.difference_step
    colder = np.where(np.array(CALIBRATED_SYMBOLS) == "R", 1.0 - step, 1.0)
    ratios = np.stack([np.ones(len(CALIBRATED_SYMBOLS)), initial_guess_ratio(), colder])
    candidates = calibrated_vector().values(ratios)
    rows = []
    for model in Replay(conditions.drives[:N_FITTED], Parameters.calibrated()).outputs(candidates):
        current = model[CURRENT_INDEX]
        calibrated, initial, cold = current.T / np.mean(current[:, 0])
        d, g = calibrated - initial, (cold - calibrated) / step
        rows.append([np.mean(d * d), np.mean(g * d), np.mean(g * g)])
    return np.array(rows)
