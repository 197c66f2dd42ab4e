"""Parametric sensitivity, one parameter at a time: the study behind Tables 8 and 9."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from epv_env.plant.parameters import Parameters, table
from epv_env.plant.simulate import energised, simulate
from identification.cases import CALIBRATION_CASES, RATE, Case
from identification.error import partial_error, relative_error, total_error

FACTORS = (0.9, 1.1)
"""The changes of Tables 8 and 9."""

THRESHOLD = 0.02
"""Total error from which the report calls a parameter Sensitive (section 5.2.2)."""

STUDY_P1, STUDY_P2, STUDY_U = 12.54e5, 6.81e5, 18.9
"""Conditions of the study [Pa, Pa, V]: not printed, found by fitting Tables 8 and 9."""


def studied_symbols() -> list[str]:
    """The parameters of Tables 6 and 7 but a1, which is zero: the report does not say its change."""
    rows = table().items()
    return [s for s, row in rows if row.source in ("Table 6", "Table 7") and s != "a1"]


def sensitivities(
    nominal: Parameters,
    *,
    symbols: Sequence[str],
    cases: Sequence[Case] = CALIBRATION_CASES,
    p1: float = STUDY_P1,
    p2: float = STUDY_P2,
    U_on: float = STUDY_U,
) -> dict[tuple[str, float], float]:
    """Total error (eq. 21, a fraction) against the nominal model for each symbol and factor.

    p1, p2: pressures at the start of each case [Pa absolute]; U_on [V]. All variants run in one batch.
    """
    changes = [(symbol, factor) for symbol in symbols for factor in FACTORS]
    p: dict[str, Any] = {s: np.full(1 + len(changes), value) for s, value in nominal.items()}
    for lane, (symbol, factor) in enumerate(changes, start=1):  # lane 0 stays nominal
        p[symbol][lane] *= factor
    partials = []
    for case in cases:
        start = energised(p, p1=p1, p2=p2, U=U_on)
        run = simulate(p, initial=start, U=case.voltage(U_on, RATE), period=1 / RATE)
        outputs = (run.state.p2, run.state.p3, run.state.I)
        errors = [relative_error(y[:, 0], y[:, 1:], run.time) for y in map(np.asarray, outputs)]
        partials.append(partial_error(errors))
    return dict(zip(changes, total_error(partials).tolist(), strict=True))
