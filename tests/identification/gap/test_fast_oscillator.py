"""Where the gap of an oscillator lies that swings thousands of times in a recording."""

import numpy as np

from identification.gap.fit.evidence import evaluate
from identification.gap.fit.recalibration import recalibrate
from identification.gap.locate.forcing import (
    MOST_VALUES,
    MOST_WINDOWS,
    WINDOWS,
    WINDOWS_TOGETHER,
    most_windows,
    resolving_edges,
)
from identification.gap.locate.localisation import Localisation, locate
from identification.gap.plant import StateTrace
from tests.identification.gap.ode_plants import swung

PERIODS = 960
"""Of the drive in a recording: twelve in each of 80 windows."""


def located() -> Localisation:
    """Where the gap lies of an oscillator with a quadratic drag."""
    problem, estimate = recalibrate(swung(PERIODS, 10, quadratic=0.05))
    residuals = evaluate(problem, [estimate])[0].residuals
    return locate(problem, estimate, residuals, seed=4)


def test_a_missing_drag_is_found_in_the_equation_of_the_speed_as_a_parabola():
    found = located()
    assert found.equation_probabilities["dv/dt"] > 0.99
    assert found.forcings[0].explained > 0.9
    term = found.missing_term
    assert term is not None
    assert (term.equation.name, term.state) == ("dv/dt", "v")
    error = (term.y + 0.05 * term.x * np.abs(term.x)) / term.sd
    assert np.sqrt(np.mean(error**2)) < 2
    assert term.explained > 0.9


def sine(periods: int) -> tuple[np.ndarray, dict[str, StateTrace]]:
    """Time and trace of an oscillation of 1 s, a fifth of which is the time scale."""
    time = np.arange(20 * periods) / 20
    return time, {"x": StateTrace(unit="m", scale=1.0, values=np.sin(2 * np.pi * time))}


def test_a_motion_that_usual_windows_follow_has_usual_windows():
    edges = resolving_edges(*sine(15), 0.19, 400, 0)
    assert len(edges) - 1 <= WINDOWS
    assert edges[-1] == 20 * 15 - 1


def test_of_a_run_that_is_too_long_the_first_part_counts():
    edges = resolving_edges(*sine(1000), 0.19, 400, 0)
    assert len(edges) - 1 <= 400
    assert np.median(np.diff(edges)) <= 3
    assert 20 * 25 < edges[-1] < 20 * 60


def test_windows_are_few_where_runs_are_many_or_long():
    assert most_windows(1, 10_000) == MOST_WINDOWS
    assert most_windows(6, 10_000) == WINDOWS_TOGETHER / 6
    assert most_windows(50, 10_000) == WINDOWS
    assert most_windows(1, 40_000) == MOST_VALUES / 40_000
