"""How far the gap is reduced: on the tank, whose noise and true cause are known."""

from functools import cache

import numpy as np
import pytest

from docs.examples.tank import NOISE, Tank, virtual_recordings
from identification.gap.fit.evidence import percentage_errors, predict
from identification.gap.fit.fitting_problem import Estimate, FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import fit
from identification.gap.fit.recalibration import recalibrate
from identification.gap.judge.black_box import ridge_on_random_features
from identification.gap.judge.held_out import (
    DiscrepancyReduction,
    measure_discrepancy_reduction,
    p_value,
)


def estimates(tank: Tank, causes: tuple[str, ...]) -> tuple[FittingProblem, dict[str, Estimate]]:
    problem, base = recalibrate(tank)
    found = {"nominal": problem.start(Hypothesis(causes=()), {}), "recalibrated": base}
    for cause in tank.causes:
        if cause.name in causes:
            trial = {cause.name: cause.parameters[0].trials[0]}
            start = problem.start(Hypothesis(causes=(cause,)), {**problem.values(base), **trial})
            found[cause.name] = fit(problem, [start])[0]
    return problem, {label: found[label] for label in ("nominal", "recalibrated", *causes)}


def reduction(truth: dict[str, float], causes: tuple[str, ...], seed: int = 1) -> DiscrepancyReduction:
    """Of a virtual tank."""
    tank = Tank(virtual_recordings(truth))
    return measure_discrepancy_reduction(*estimates(tank, causes), seed=seed)


@cache
def leaking(causes: tuple[str, ...] = ("leak", "lag")) -> DiscrepancyReduction:
    return reduction({"c": 0.021, "leak": 4e-3}, causes)


def test_the_true_cause_closes_the_gap_and_another_does_not():
    found = leaking()
    assert found.gaps["nominal"].overall.value > found.gaps["recalibrated"].overall.value > 2
    assert found.gaps["leak"].overall.low < 1 < found.gaps["leak"].overall.high
    assert found.shares_closed["leak"].high == 1.0
    assert found.shares_closed["leak"].low > 0.9
    assert found.shares_closed["lag"].high < 0.1
    assert found.unexplained.fraction < 0.05
    assert not found.unexplained.still_predictable


def test_without_the_true_cause_the_rest_is_predictable():
    found = leaking(("lag",))
    assert found.unexplained.fraction > 0.9
    assert found.unexplained.still_predictable
    assert found.black_box_helps
    assert found.black_box.overall.value < found.gaps["recalibrated"].overall.value


def test_a_black_box_that_does_harm_is_left_out(monkeypatch):
    """It predicts the opposite of what the recalibrated model leaves."""
    tank = Tank(virtual_recordings({"c": 0.021, "leak": 4e-3}))
    problem, found = estimates(tank, ())
    model = predict(problem, found["recalibrated"])
    first, second, held_out = model.residuals
    opposite = [np.zeros_like(first), np.zeros_like(second), -held_out]
    monkeypatch.setattr("identification.gap.judge.held_out.predict_residuals", lambda *_: opposite)
    judged = measure_discrepancy_reduction(problem, found)
    assert not judged.black_box_helps
    assert judged.black_box.overall == judged.gaps["recalibrated"].overall
    assert judged.unexplained.p_value == 1
    assert not judged.unexplained.still_predictable


def test_without_a_gap_nothing_is_told_of_its_shrinking():
    found = measure_discrepancy_reduction(
        *estimates(Tank(virtual_recordings({"c": 0.021})), ("leak",)), seed=1
    )
    assert found.gaps["recalibrated"].overall.low < 1 < found.gaps["recalibrated"].overall.high
    assert found.shares_closed["leak"].high - found.shares_closed["leak"].low > 0.5
    assert found.unexplained.fraction == 0


def test_the_gap_is_that_of_known_noise_and_misfit():
    """A misfit of a known size added to a perfect model's held-out readings."""
    tank = Tank(virtual_recordings({"c": 0.021, "leak": 4e-3}, seed=3))
    problem, found = estimates(tank, ("leak",))
    tank.runs[2].measured[:] += 3 * NOISE * np.sqrt(2) * np.sin(tank.runs[2].time / 4)
    gap = measure_discrepancy_reduction(FittingProblem(tank, problem.slopes), found).gaps["leak"].overall
    assert gap.value == pytest.approx(np.sqrt(1 + 9), rel=0.12)


@pytest.mark.parametrize(
    ("offset", "amplitude", "has_percent"),
    [
        (0.0, 1.0, False),  # a voltage about 0
        (0.0, 0.0, False),  # a channel at rest at 0
        (1.0, 0.9, True),
        (1.0, 1.0 + 0.5 * NOISE, True),  # on one side of 0 but for noise
    ],
)
def test_only_a_channel_that_keeps_its_sign_has_a_percentage(offset, amplitude, has_percent):
    tank = Tank(virtual_recordings({}))
    tank.runs[2].measured[:] = offset + amplitude * np.sin(2 * np.pi * np.arange(240) / 239)
    found = percentage_errors(tank, [run.measured for run in tank.runs])
    assert (found is not None) == has_percent


def task(seed: int, wave: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    features = rng.standard_normal((400, 4))
    told = wave * np.sin(features[:, 0]) * features[:, 1]
    return features, (told + rng.standard_normal(400))[:, None]


def left(wave: float) -> tuple[float, float]:
    """Mean square of an unseen run, and what is left of it."""
    features, target = task(9, wave)
    (predicted,) = ridge_on_random_features([task(seed, wave) for seed in range(4)], [features], 0)
    return float(np.mean(target**2)), float(np.mean((target.T - predicted) ** 2))


def test_what_features_tell_is_predicted_on_a_run_never_seen():
    before, after = left(5.0)
    assert after - 1 < 0.2 * (before - 1)


def test_noise_is_left_alone():
    before, after = left(0.0)
    assert abs(after - before) < 0.02


def test_a_prediction_of_noise_is_as_good_as_chance_and_of_itself_is_not():
    plant = Tank(virtual_recordings({}))
    rng = np.random.default_rng(4)
    residuals = [rng.standard_normal((1, 240)) for _ in plant.runs]
    chance = [
        p_value(plant, residuals, [rng.standard_normal((1, 240))] * 3, seed, 5.0) for seed in range(60)
    ]
    assert 0.35 < np.mean(chance) < 0.65
    assert p_value(plant, residuals, residuals, 0, 5.0) < 0.002
    assert p_value(plant, residuals, [np.zeros((1, 240))] * 3, 0, 5.0) == 1.0
