"""The black box: it finds what inputs and outputs tell, nothing in noise, and sees no target."""

import numpy as np

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.judge.black_box import ridge_on_random_features
from identification.gap.judge.held_out import p_value


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
