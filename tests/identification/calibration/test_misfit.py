"""The misfit is eq. 21 less its nuisances, as a function of a vector of scaled parameters."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.calibration.problem import (
    ParameterVector,
    WeightedResiduals,
    measured_outputs,
    noise_weights,
    report_weights,
)
from identification.replay.replay import P2_SHIFT
from identification.report_2003 import partial_error, relative_error, total_error
from tests.identification.twins import TRUE, problem


def true_vector():
    return problem().vector.scaled(TRUE)


def eq21(misfit, z):
    """The total error without any nuisance."""
    models = misfit.replay.outputs(misfit.vector.values(z))
    partial = []
    for recording, measured, model in zip(problem().calibration, misfit.measured, models, strict=True):
        pairs = zip(measured, model[:, :, 0], strict=True)
        partial.append(partial_error([relative_error(y, m, recording.time) for y, m in pairs]))
    return float(total_error(partial))


def changed(**changes):
    """Least squares on recordings with channels changed by functions of (time, values)."""
    recordings = [
        replace(r, **{name: change(r.time, r.channel(name)) for name, change in changes.items()})
        for r in problem().calibration
    ]
    return WeightedResiduals(recordings, problem().vector, noise_weights(recordings, problem().noise))


def moved(**changes):
    """How far `changed` moves the residuals, as a share of how far the measurements move."""
    before, after = problem().least_squares(), changed(**changes)
    apart = [
        w * (b - a) for w, b, a in zip(before.weights, before.measured, after.measured, strict=True)
    ]
    residuals = [np.concatenate(m.residuals(true_vector())) for m in (before, after)]
    return np.linalg.norm(residuals[1] - residuals[0]) / np.sqrt(sum(np.sum(a**2) for a in apart))


def test_it_is_eq_21_where_nuisances_explain_nothing():
    """Measured is the model and a deviation of p2 that is orthogonal to a changed start."""
    misfit, z = problem().total_error(), true_vector()
    values = misfit.vector.values(np.stack([z, z]))
    models = misfit.replay.outputs({**values, P2_SHIFT: np.array([0.0, 100.0])})
    rng = np.random.default_rng(0)
    misfit.measured, misfit.weights = [], []
    for recording, model in zip(problem().calibration, models, strict=True):
        outputs = dict(zip(("p2", "p3", "I"), model[:, :, 0], strict=True))
        share = report_weights([replace(recording, **outputs)])[0][0] ** 2
        start = model[0, :, 1] - model[0, :, 0]
        both = np.stack([start, np.ones_like(start)], axis=1)  # the mean of p2 is part of eq. 19
        noise = 2e4 * rng.standard_normal(len(recording))
        deviation = noise - both @ np.linalg.solve(
            both.T @ (share[:, None] * both), both.T @ (share * noise)
        )
        outputs["p2"] = outputs["p2"] + deviation
        misfit.measured.append(measured_outputs(replace(recording, **outputs)))
        weights = report_weights([replace(recording, **outputs)])[0]
        misfit.weights.append(weights / np.sqrt(len(models)))
    assert misfit.error(z) == pytest.approx(eq21(misfit, z), rel=1e-6)
    assert misfit.error(z) > 0.01


def test_noise_weights_make_the_right_model_s_residuals_one():
    residuals = np.concatenate(problem().least_squares().residuals(true_vector()))
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("channel", "size"), [("p3", 5e3), ("I", 0.01)])
def test_a_constant_error_of_the_p3_and_i_sensors_is_not_seen_and_a_drift_is(channel, size):
    assert moved(**{channel: lambda time, values: values + size}) < 1e-9
    assert moved(**{channel: lambda time, values: values + size * time}) > 0.3


def test_a_wrong_start_of_p2_is_hardly_seen():
    """200 Pa in the first 40 ms go into the start, out of which the nuisance takes them again."""
    before = np.concatenate(problem().least_squares().residuals(true_vector()))
    misfit = problem().least_squares()
    misfit.replay.drives = [replace(d, p2_start=d.p2_start + 200.0) for d in misfit.replay.drives]
    after = np.concatenate(misfit.residuals(true_vector()))
    assert np.linalg.norm(after - before) < 1e-3 * np.linalg.norm(before)


@pytest.mark.parametrize("away", [1.0, 1.005])
def test_derivatives_are_central_differences(away):
    """Up to the share that the nuisances' own change has, which grows with the residual."""
    misfit, z = problem().least_squares(), away * true_vector()
    derivative = np.vstack(misfit.linearised(z)[1])
    for column, axis in zip(derivative.T, 1e-5 * np.eye(4), strict=True):
        ends = [np.concatenate(misfit.residuals(z + way * axis)) for way in (-1, 1)]
        difference = (ends[1] - ends[0]) / 2e-5
        assert np.linalg.norm(column - difference) < 0.02 * np.linalg.norm(difference)


START = Parameters.initial_guess()
FOUR = ParameterVector(CALIBRATED_SYMBOLS, START)


def test_a_set_comes_back():
    parameters = FOUR.parameters(FOUR.scaled(TRUE))
    for symbol in TRUE:
        assert parameters[symbol] == pytest.approx(
            TRUE[symbol] if symbol in FOUR.symbols else START[symbol]
        )


def test_bounds_are_the_ends_of_the_domains():
    for symbol, ends in zip(FOUR.symbols, FOUR.bounds, strict=True):
        assert tuple(ends * START[symbol]) == pytest.approx(table()[symbol].domain)


def test_bounds_rise_for_a_negative_reference_too():
    """a1's domain is symmetric about zero."""
    (ends,) = ParameterVector(("a1",), TRUE.replace(a1=-0.05)).bounds
    assert tuple(ends) == pytest.approx((-2.0, 2.0))


@pytest.mark.parametrize(("z", "end"), [(100.0, 1), (-1.0, 0)])
def test_a_vector_outside_is_moved_to_the_end_of_the_domain(z, end):
    """Exactly, though 0.5 / 0.72 * 0.72 is less than 0.5."""
    moved = FOUR.parameters(np.full(4, z))
    assert [moved[symbol] for symbol in FOUR.symbols] == FOUR.domains[:, end].tolist()
