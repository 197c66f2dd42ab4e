"""A learnt term acts on the plant as the forcing that it amounts to."""

import numpy as np
import pytest

from epv_env.plant.effects.learnt import EQUATIONS, KNOTS
from identification.replay.model_inputs import ModelInputs
from identification.valve_gap.equations import forced_changes, modelled, traces
from tests.plant.test_learnt import CALIBRATED, term

NOISE = {"p2": 980.0, "p3": 750.0, "I": 8e-4}
"""Of the sensors [SI]."""


def inputs() -> ModelInputs:
    U = np.full(6000, 24.0)
    U[500:1500] = U[3000:4500] = 0.0
    return ModelInputs(
        period=1e-4, U=U, sigma_S=np.full(len(U), 1e-3), p1=np.full(len(U), 12e5), U_start=24.0,
        p2_start=6.8e5,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("equation", "state"),
    [("f1", "p1 - p2"), ("f2", "p3"), ("f4", "xPV"), ("f6", "I"), ("f7", "U")],
)
def test_a_small_term_is_felt_as_the_forcing_that_it_amounts_to(equation, state):
    own, drive = term(equation, state), inputs()
    answer = [modelled(drive, p) for p in (CALIBRATED, CALIBRATED.replace(**own.parameters))]
    trace = traces(answer[0])[state].values
    width = (own.high - own.low) / (KNOTS - 1)
    knots = np.linspace(own.low - width, own.high + width, KNOTS + 2)
    forcing = EQUATIONS[equation][1] * np.interp(trace, knots, [0.0, *own.values, 0.0])
    expected = forced_changes(drive, CALIBRATED, {equation: forcing[:, None]})[..., 0]
    found = np.array(
        [np.asarray(getattr(answer[1].state, y)) - getattr(answer[0].state, y) for y in NOISE]
    )
    noise = np.array(list(NOISE.values()))[:, None]
    assert np.max(np.abs(expected) / noise) > 0.1
    assert np.sum(((found - expected) / noise) ** 2) < 0.15**2 * np.sum((expected / noise) ** 2)


def test_a_term_of_zeros_changes_no_bit():
    leaking = CALIBRATED.replace(A_PV=1e-8)
    zeros = leaking.replace(**term("f1", "p3", (0.0,) * KNOTS).parameters)
    first, second = (modelled(inputs(), p).state for p in (leaking, zeros))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)
