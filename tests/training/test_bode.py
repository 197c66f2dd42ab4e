"""The Bode plot shows the loop that was designed: its margins are python-control's of the same loop."""

import numpy as np
import pytest

pytest.importorskip("control")

import control

from controllers.pwm_design import design, open_loop
from epv_env.plant.parameters import Parameters
from training.bode import bode

pytestmark = pytest.mark.training


@pytest.fixture(scope="module")
def designed():
    return design(
        Parameters.calibrated(), p1=11.5e5, p2=8e5, period=20e-3, inner_time=0.02, phase_margin=40.0,
        integral_time=1.0,
    )  # fmt: skip


def test_margins_as_designed_are_those_of_the_drawn_loop(designed):
    gain_margin, phase_margin, _, crossover = control.margin(open_loop(designed))
    assert gain_margin == pytest.approx(designed.gain_margin, rel=1e-12)
    assert phase_margin == pytest.approx(designed.phase_margin, rel=1e-12)
    assert crossover == pytest.approx(designed.crossover, rel=1e-12)


def test_the_gain_margin_is_where_the_loop_turns_unstable(designed):
    """Times the margin the loop passes through -1: at its phase crossover it is real and -1."""
    loop = open_loop(designed)
    _, _, at_phase, _ = control.margin(loop)
    values = np.asarray(loop.frdata).reshape(-1)
    parts = (np.interp(at_phase, loop.omega, part) for part in (np.real(values), np.imag(values)))
    there = complex(*parts)
    assert designed.gain_margin * there == pytest.approx(-1.0, abs=0.01)


def test_a_picture_is_written(designed, tmp_path):
    path = bode(designed, tmp_path / "new" / "bode.png")
    assert path.read_bytes().startswith(b"\x89PNG")
