"""Experiment design: the chosen experiment tells the rivals apart, and as well as expected."""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import expit
from scipy.stats import norm

from identification.gap.diagnosis import rank_hypotheses
from identification.gap.experiment_design import (
    FORM_ERROR,
    ParameterPosterior,
    Rivals,
    expected_information,
    information_gain,
    kullback_leibler_divergences,
    odds_text,
    outcome_distributions,
    select_rivals,
)
from identification.gap.plant import Cause, Channel, FreeParameter, NuisanceParameter, Run
from identification.gap.variable_projection import LinearisedRun
from identification.gap.verdict import Ranking

NOISE, SAMPLES, PERIOD = 0.02, 40, 1e-3
SUPPLIES = (12.0, 10.0, 8.0, 6.0, 4.0)
TRUTH = {"gain": 0.7, "offset": 0.1}


class Gauge:
    """y = gain u + offset + bend min(u, 8)/8: above a supply u of 8 the two causes are the same."""

    channels = (Channel(name="y", unit="1", scale=1.0, noise=NOISE),)
    parameters = (FreeParameter(symbol="gain", unit="1", low=0.1, high=2.0, nominal=0.6, scale=0.6),)
    tolerances = (NuisanceParameter(symbol="curve", sd=5e-4, step=5e-4),)
    run_offsets = (NuisanceParameter(symbol="zero", sd=0.01, step=0.01),)
    equations = ()

    def __init__(self, supplies: Sequence[float], *, exact: bool, seed: int | None = None):
        """Runs in which the supply falls by 1; seed: of their noise, None: nothing measured yet."""
        self.causes = tuple(
            Cause(name=name, component="", parameters=(_parameter(name),), exact_form=exact)
            for name in ("offset", "bend")
        )
        rng = np.random.default_rng(seed)
        made = []
        for k, supply in enumerate(supplies):
            u = supply - np.linspace(0.0, 1.0, SAMPLES)
            true = {symbol: np.array([value]) for symbol, value in TRUTH.items()}
            y = response(true, u)[:, 0] + rng.normal(0.0, NOISE, SAMPLES)
            made.append(
                Run(
                    name=f"from {supply:g}", held_out=k == 2, time=PERIOD * np.arange(SAMPLES),
                    measured=(y if seed is not None else 0.0 * y)[None],
                    trusted=np.ones((1, SAMPLES), dtype=bool), inputs={"u": u},
                )
            )  # fmt: skip
        self.runs = tuple(made)

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`."""
        return [response(values, self.runs[r].inputs["u"])[None] for r in runs]

    def states(self, values, run):
        """`GreyBox.states`."""
        return {}

    def regimes(self, values, run):
        """`GreyBox.regimes`."""
        return {}

    def forced(self, values, run, forcing):
        """`GreyBox.forced`: never, without equations."""
        raise NotImplementedError

    def contribution(self, values, symbols, run):
        """`GreyBox.contribution`: left to the change of the readings."""


def _parameter(name: str) -> FreeParameter:
    return FreeParameter(symbol=name, unit="1", low=-3.0, high=3.0, trials=(0.1,), scale=0.1)


def response(values: Mapping[str, NDArray], u: NDArray) -> NDArray:
    """Outputs (samples, n)."""
    n = max(len(value) for value in values.values())
    p = {s: values.get(s, np.zeros(n)) for s in ("gain", "offset", "bend", "curve", "zero")}
    line = np.outer(u, p["gain"]) + p["offset"] + np.outer(u**2, p["curve"])
    return line + np.outer(np.minimum(u, 8.0) / 8.0, p["bend"]) + p["zero"]


@cache
def diagnosed(exact: bool) -> Ranking:
    """A gauge that is off, recorded under high supplies only."""
    return rank_hypotheses(Gauge((12.0, 10.0, 11.0, 12.5, 9.5), exact=exact, seed=4))


def two(found: Ranking) -> Rivals:
    """The two causes alone."""
    estimates = {each.labels: each.estimate for each in found.hypotheses}
    return Rivals(estimates=(estimates["offset",], estimates["bend",]), probability=(0.55, 0.45))


def test_causes_that_differ_under_a_low_supply_only_are_split_there():
    found = diagnosed(exact=False)
    rivals = two(found)
    promised = expected_information(found.problem, Gauge(SUPPLIES, exact=False), rivals)
    best = [gain.expected_best for gain in promised]
    assert best[:2] == pytest.approx([0.55, 0.55], abs=0.01)
    assert np.argmin([gain.expected_entropy for gain in promised]) == SUPPLIES.index(4.0)
    assert best[-1] > best[-2] > best[-3] > 0.56
    assert best[-1] > 0.8


def test_predictions_are_those_of_the_whole_covariances():
    """In the coordinates of `outcome_distributions` densities differ as they do over all samples."""
    rng = np.random.default_rng(0)
    channels, samples, period = 2, 23, 1e-3
    n = channels * samples
    runs = [
        LinearisedRun(
            residual=rng.normal(size=n), slopes=rng.normal(size=(n, 2)),
            run_slopes=rng.normal(size=(n, 3)), run_values=np.zeros(3),
            run_sd=np.array([0.3, 2.0, 1.0]), shared_slopes=rng.normal(size=(n, 4)),
        )
        for _ in range(3)
    ]  # fmt: skip
    known = [ParameterPosterior(mean=rng.normal(size=6), factor=rng.normal(size=(6, 6))) for _ in runs]
    effects = 20 * rng.normal(size=(n, 2))
    number = np.concatenate([np.arange(samples) // 5, 100 + np.arange(samples) // 5])
    noise = np.eye(n)
    for effect in effects.T * FORM_ERROR:
        noise += np.outer(effect, effect) * (number[:, None] == number) / 3
    whole = []
    means = []
    for line, own in zip(runs, known, strict=True):
        numbers = np.column_stack([line.slopes, line.shared_slopes])
        means.append(numbers @ own.mean - line.residual)
        columns = numbers @ own.factor
        local = line.run_slopes * line.run_sd
        whole.append(np.linalg.cholesky(noise + columns @ columns.T + local @ local.T))
    expected = kullback_leibler_divergences(np.stack(means), np.stack(whole))
    own_means, covariances = outcome_distributions(runs, known, effects, channels, period)
    found = kullback_leibler_divergences(own_means, np.linalg.cholesky(covariances))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(("distance", "first"), [(0.0, 0.55), (2.0, 0.5), (4.0, 0.9)])
def test_the_information_about_two_rivals_has_the_closed_form(distance, first):
    """Log Bayes factors of two Gaussians: mean half the squared distance, variance that distance."""
    means = np.array([[0.0], [distance]])
    found = information_gain(means, np.ones((2, 1, 1)), (first, 1 - first), outcomes=1000)
    prior = np.log(first / (1 - first))

    def expected(what, sign):
        return quad(
            lambda z: norm.pdf(z) * what(sign * prior + 0.5 * distance**2 + distance * z), -9, 9
        )[0]

    assert found.expected_probability == pytest.approx(
        (expected(expit, 1), expected(expit, -1)), abs=0.02
    )
    best = [expected(lambda x: max(expit(x), expit(-x)), sign) for sign in (1, -1)]
    assert found.expected_best == pytest.approx(first * best[0] + (1 - first) * best[1], abs=0.02)
    assert found.log_bayes_factor[0, 1] == pytest.approx(0.5 * distance**2)


def test_an_experiment_that_shows_nothing_leaves_the_odds():
    before = (0.5, 0.3, 0.2)
    covariances = np.stack([np.diag([1.0, 4.0])] * 3)
    found = information_gain(np.zeros((3, 2)), covariances, before, outcomes=1000)
    assert found.expected_probability == pytest.approx(before)
    assert found.expected_best == pytest.approx(0.5)
    assert found.expected_entropy == pytest.approx(-np.sum(np.array(before) * np.log(before)))
    np.testing.assert_allclose(found.log_bayes_factor, 0.0, atol=1e-12)


def test_a_run_that_a_rival_cannot_simulate_promises_nothing():
    class Failing(Gauge):
        def outputs(self, values, runs):
            found = super().outputs(values, runs)
            return [
                np.where(values.get("bend", np.zeros(1)) != 0, np.nan, f) if r == 1 else f
                for r, f in enumerate(found)
            ]

    found = diagnosed(exact=True)
    rivals = two(found)
    promised = expected_information(found.problem, Failing((4.0, 4.0), exact=True), rivals)
    assert promised[1].expected_best == pytest.approx(0.55)
    assert promised[0].expected_best > 0.8


def test_rivals_are_the_most_probable_hypotheses():
    rivals = select_rivals(diagnosed(exact=True))
    assert 2 <= len(rivals.estimates) <= 4
    assert sum(rivals.probability) == pytest.approx(1.0)
    assert list(rivals.probability) == sorted(rivals.probability, reverse=True)
    assert [odds_text(p) for p in (0.5, 0.976, 0.999)] == ["50:50", "98:2", "better than 99:1"]
