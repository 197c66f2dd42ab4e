"""The coverage study: the same numbers however it is run, and shares with exact intervals."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.stats import beta

from identification.calibration.search_methods import nelder_mead
from identification.calibration.settings import CalibrationSettings
from identification.studies.coverage import coverage
from identification.studies.coverage.coverage import Coverage, coverage_study
from identification.studies.coverage.coverage_section import coverage_json, coverage_section
from identification.studies.proportion import Proportion

ARRAYS = ("distance", "independent", "disagreement", "inside", "report_inside", "report_joint")


class InProcess:
    """Replaces the pool of processes."""

    asked: list[int] = []  # noqa: RUF012 - shared on purpose: the campaigns of all pools

    def __init__(self, workers, context, initializer, initargs):
        initializer(*initargs)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        return None

    def map(self, function, items):
        for item in items:
            self.asked.append(item)
            yield function(item)


@pytest.fixture
def asked(monkeypatch):
    """Campaigns that were calibrated, in this process, the Nelder-Mead searches cut short."""
    short = partial(nelder_mead, settings=CalibrationSettings(most_evaluations=30))
    monkeypatch.setattr(coverage, "nelder_mead", short)
    monkeypatch.setattr(coverage, "ProcessPoolExecutor", InProcess)
    monkeypatch.setattr(InProcess, "asked", [])
    return InProcess.asked


def assert_same(one, other, campaigns):
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name)[:campaigns], getattr(other, name)[:campaigns])


def study(distance, symbols=("alphaMV", "alphaPV", "RML", "R")):
    """A study of which only the distances matter."""
    distance = np.asarray(distance, dtype=float)
    inside = np.ones((len(distance), len(symbols)), dtype=bool)
    return Coverage(
        symbols=symbols,
        distance=distance,
        independent=2 * distance,
        disagreement=0 * distance,
        inside=inside,
        report_inside=inside,
        report_joint=inside[:, 0],
    )


@pytest.mark.parametrize(("hits", "count"), [(190, 200), (3, 4), (0, 10), (10, 10)])
def test_shares_have_clopper_and_pearson_s_interval(hits, count):
    """Quantiles of beta distributions; 0 and 1 at the ends."""
    proportion = Proportion.count(np.arange(count) < hits)
    low, high = proportion.interval
    assert proportion.value == hits / count
    assert low == pytest.approx(beta.ppf(0.025, hits, count - hits + 1) if hits else 0.0)
    assert high == pytest.approx(beta.ppf(0.975, hits + 1, count - hits) if hits < count else 1.0)


def test_campaigns_are_the_same_however_many_there_are(tmp_path, asked):
    one = coverage_study(journal=tmp_path / "one", campaigns=1, seed=3)
    two = coverage_study(journal=tmp_path / "two", campaigns=2, seed=3)
    assert asked == [0, 0, 1]
    assert_same(one, two, 1)
    assert two.distance[0] != two.distance[1]
    assert np.all(two.distance < 100)


def test_finished_campaigns_of_the_same_seed_are_taken_from_the_journal(tmp_path, asked):
    journal = tmp_path / "journal"
    first = coverage_study(journal=journal, campaigns=2, seed=3)
    text = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(text[:2]) + text[2][:50])
    asked.clear()
    again = coverage_study(journal=journal, campaigns=2, seed=3)
    assert asked == [1]
    assert_same(first, again, 2)
    assert_same(first, coverage_study(journal=journal, campaigns=2, seed=3), 2)
    assert asked == [1]
    other = coverage_study(journal=journal, campaigns=1, seed=4)
    assert asked == [1, 0]
    assert other.distance[0] != first.distance[0]


@pytest.mark.slow
def test_processes_change_nothing(tmp_path):
    one = coverage_study(journal=tmp_path / "one", campaigns=2, seed=3, workers=1)
    two = coverage_study(journal=tmp_path / "two", campaigns=3, seed=3, workers=2)
    assert_same(one, two, 2)
    names = [json.loads(line)["name"] for line in (tmp_path / "two").read_text().splitlines()[1:]]
    assert names == ["0", "1", "2"]


def test_distances_that_follow_chi_square_are_covered():
    rng = np.random.default_rng(0)
    good = study(rng.chisquare(4, 400))
    assert coverage_section(good).verdicts[0].status == "good"
    assert coverage_json(good)["joint region"]["share"] == pytest.approx(0.95, abs=0.03)


def test_a_region_that_is_half_as_large_is_noticed():
    """The share under independence is even smaller."""
    rng = np.random.default_rng(0)
    small = study(2 * rng.chisquare(4, 400))
    assert coverage_section(small).verdicts[0].status == "bad"
    shares = coverage_json(small)
    independent = shares["joint region if residuals were independent and inputs exact"]
    assert independent["share"] < shares["joint region"]["share"] < 0.9


def test_the_methods_agree_as_far_as_the_region_holds():
    apart = replace(study([1.0] * 4), disagreement=np.array([1.0, 9.0, 10.0, 100.0]))
    assert apart.agree.tolist() == [True, True, False, False]
