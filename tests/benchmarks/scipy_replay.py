"""The identification's alternative: recordings replayed through SciPy's LSODA, one run at a time.

Everything else is the identification's own: voltage and start of each recording, the nuisances that are
solved for, the error, the search. LSODA locates the stops' events on a compiled right-hand side. Its
supply is the bench's reservoir, not the recorded p1: a slope for every sample would make it start anew
every half millisecond.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from identification.bench.hybrid_automaton import piecewise_schedule
from identification.bench.reference_simulation import simulate_reference
from identification.bench.session import RESERVOIR_VOLUME
from identification.calibration.problem import CalibrationProblem
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.replay.weighted_residuals import WeightedResiduals

RTOL = 1e-6


class ScipyReplay(Replay):
    """Simulates recordings under candidate parameters, none of them in a batch."""

    def outputs(
        self,
        candidates: Mapping[str, NDArray],
        p2_shift: ArrayLike = 0.0,
        which: Sequence[int] | None = None,
    ) -> list[NDArray]:
        """As Replay.outputs, for candidates that are the same for all recordings."""
        chosen = range(len(self.drives)) if which is None else which
        n = max(np.size(value) for value in candidates.values())
        shift = np.broadcast_to(np.asarray(p2_shift, dtype=float), (n,))
        parameters = [
            self.base.replace(**{symbol: float(value[i]) for symbol, value in candidates.items()})
            for i in range(n)
        ]
        return [
            np.stack([_answer(drive, p, dp) for p, dp in zip(parameters, shift, strict=True)], axis=2)
            for drive in (self.drives[r] for r in chosen)
        ]


def scipy_misfit(problem: CalibrationProblem) -> WeightedResiduals:
    """The problem's total error with SciPy as the simulator."""
    misfit = problem.total_error()
    misfit.replay = ScipyReplay(misfit.replay.drives, misfit.replay.base)
    return misfit


def _answer(drive: ModelInputs, parameters: Parameters, p2_shift: float) -> NDArray:
    """OUTPUTS of one recording under one set of parameters, (3, samples)."""
    start = energised(parameters, p1=drive.p1_start, p2=drive.p2_start + p2_shift, U=drive.U_start)
    time = np.arange(len(drive.U)) * drive.period
    schedule = piecewise_schedule(
        parameters, start, time, U=drive.U[:-1], reservoir_volume=RESERVOIR_VOLUME
    )
    state = simulate_reference(schedule, time, rtol=RTOL).state
    return np.stack([state.p2, state.p3, state.I])
