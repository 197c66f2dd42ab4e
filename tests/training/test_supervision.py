"""A supervisor is settled where no figure's ratio to the adaptive pulse's is large."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("joblib")
pytest.importorskip("scipy")

from controllers.learned import TRAINED, load_policy
from controllers.supervised import load_settings, supervised
from controllers.supervisor_settings import SETTINGS
from epv_env.plant.plantfile import Plant
from tests.training.policies import random_layers, write_policy
from training.evaluation.metrics import summary
from training.learners import supervision
from training.learners.settling_search import QUICK_SETTLING, SETTLED, SETTLING
from training.learners.supervision import (
    settle,
    settle_missing,
    tail,
    upper_ratio,
)
from training.learners.validation import ValidationSettings, validate

pytestmark = pytest.mark.training


def exactly(*figures: float) -> np.ndarray:
    """The same figures in two episodes."""
    return np.repeat(np.array(figures)[:, None], 2, axis=1)


def figures_by_settings(rms, breakdown, switchings, excursion=lambda h, f: 0.0):
    """Stands for episodes: the rival's figures are 1, ours follow from height and `free_below`."""

    def figures(controller, validation, options):
        if controller.name == "pulse, adaptive":
            return exactly(1.0, 1.0, 1.0, 1.0)
        at = controller.main.settings
        ours = (rms, breakdown, switchings, excursion)
        return exactly(*(f(at.height, at.free_below) for f in ours))

    return figures


@pytest.fixture(scope="module")
def policy():
    return load_policy(TRAINED / "end-to-end" / "seed-0")


def test_the_settings_are_where_the_three_ratios_are_equal(policy, monkeypatch):
    """1 + 5 h, 0.9 - 5 h - f and 1.1 + f are all 1 at h = 0 and f = -0.1."""
    figures = figures_by_settings(
        lambda h, f: 1 + 5 * h, lambda h, f: 0.9 - 5 * h - f, lambda h, f: 1.1 + f
    )
    monkeypatch.setattr(supervision, "_figures", figures)
    found = settle(policy, Plant.calibrated(), {}, replace(SETTLING, evaluations=120))
    assert found.settings.height == pytest.approx(0.0, abs=0.004)
    assert found.settings.free_below == pytest.approx(-0.1, abs=0.015)
    changed = {name: getattr(found.settings, name) for name in SETTLED}
    assert found.settings == replace(SETTINGS, near_miss_share=SETTLING.near_miss_share, **changed)
    assert 10 ** SETTLING.least[2] <= found.settings.reluctance <= 10 ** SETTLING.greatest[2]
    assert found.search["largest_ratio"] == pytest.approx(1.0, abs=0.02)
    assert found.search["at_bound"] == []


def test_a_search_that_has_not_come_far_goes_on(policy, monkeypatch):
    """The optimum of 1 at h = -0.08 and f = 0.2 is far from the start."""
    figures = figures_by_settings(
        lambda h, f: 1 + 5 * abs(h + 0.08), lambda h, f: 1 + 2 * abs(f - 0.2), lambda h, f: 0.9
    )
    monkeypatch.setattr(supervision, "_figures", figures)
    once, twice = (
        settle(
            policy, Plant.calibrated(), {}, replace(SETTLING, evaluations=7, rounds=n), quiet=True
        ).search["largest_ratio"]
        for n in (1, 2)
    )  # fmt: skip
    assert once > SETTLING.again_above
    assert twice < once


def test_a_search_that_ends_at_a_bound_says_so(policy, monkeypatch, capsys):
    """The lower the better: the height ends at the least that is searched."""
    figures = figures_by_settings(lambda h, f: 1 + h, lambda h, f: 1 + h, lambda h, f: 1 + h)
    monkeypatch.setattr(supervision, "_figures", figures)
    found = settle(policy, Plant.calibrated(), {}, replace(SETTLING, evaluations=120), quiet=True)
    assert found.search["at_bound"] == ["height"]
    assert "search of height ended at a bound" in capsys.readouterr().err


def test_the_worst_episodes_bound_what_the_means_ask_for(policy, monkeypatch):
    """The lower the better but for the excursion: the ratios 1 + 2 h and 1 - h are equal at h = 0."""

    def lower(h, f):
        return 1 - h

    figures = figures_by_settings(lower, lower, lower, lambda h, f: 0.46 * (1 + 2 * h))
    monkeypatch.setattr(supervision, "_figures", figures)
    found = settle(policy, Plant.calibrated(), {}, replace(SETTLING, evaluations=120), quiet=True)
    assert found.settings.height == pytest.approx(0.0, abs=0.004)


def test_a_figure_that_the_rival_has_none_of_counts_as_equal():
    own, usual = exactly(1.0, 5.0, 1.0, 0.23), exactly(1.0, 0.0, 2.0, 9.0)
    assert supervision._ratios(own, usual, 0.46) == [1.0, 1.0, 0.5, 0.5]


def test_the_upper_end_of_a_ratio_is_that_of_its_interval():
    """In 2.5 % of many repetitions the true ratio of 0.9 is above the end: the estimate errs."""
    rng, above = np.random.default_rng(0), 0
    for _ in range(4000):
        usual = 10.0 + 3.0 * rng.standard_normal(400)
        own = 9.0 + 2.0 * (usual[:100] - 10.0) / 3.0 + rng.standard_normal(100)
        above += upper_ratio(own, usual) < 0.9
    assert above / 4000 == pytest.approx(0.025, abs=0.008)


def test_pairs_of_episodes_narrow_the_interval():
    rng = np.random.default_rng(1)
    usual = 10.0 + 3.0 * rng.standard_normal(400)
    own = 0.9 * usual[:100] + 0.1 * rng.standard_normal(100)
    strangers = 0.9 * rng.permutation(usual)[:100]
    assert 0.9 < upper_ratio(own, usual) < 0.91
    assert upper_ratio(strangers, usual) > upper_ratio(own, usual) + 0.01


def test_the_tail_is_the_mean_of_the_worst_hundredth():
    assert tail(np.arange(300.0)) == 298.0
    assert tail(np.array([1.0, 3.0, 2.0])) == 3.0  # one at least


def test_a_higher_setpoint_breaks_down_less_and_errs_more(policy):
    """What the search presumes, on the plant itself."""
    plant, settings = Plant.calibrated(), ValidationSettings(episodes=64, duration=3.0)
    low, high = (
        summary(validate(supervised(policy, plant, replace(SETTINGS, height=h)), settings, {}))
        for h in (-0.03, 0.04)
    )
    assert high["C2_event_breakdown_bar"] < low["C2_event_breakdown_bar"] - 0.03
    assert high["rms_error_bar"] > low["rms_error_bar"]


def test_a_reluctant_policy_switches_less(policy):
    plant, settings = Plant.calibrated(), ValidationSettings(episodes=64, duration=3.0)
    cautious = replace(SETTINGS, free_below=-0.06)
    eager, reluctant = (
        summary(validate(supervised(policy, plant, replace(cautious, reluctance=r)), settings, {}))
        for r in (0.0, 400.0)
    )
    assert reluctant["switchings_per_s"] < 0.95 * eager["switchings_per_s"]


def test_missing_supervisors_are_settled_alike_by_one_worker_or_two(tmp_path):
    folders = [tmp_path / name for name in ("a", "b", "c")]
    for folder in folders:
        write_policy(random_layers(seed=3, widths=(8, 8)), folder)
    settle_missing(folders[:1], workers=1, search=QUICK_SETTLING)
    before = load_settings(folders[0])
    settle_missing(folders, workers=2, search=QUICK_SETTLING)
    assert [load_settings(folder) for folder in folders] == [before] * 3
