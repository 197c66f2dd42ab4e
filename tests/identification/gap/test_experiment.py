"""The next experiment: what is chosen does tell the rivals apart, and as well as it was promised."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import expit, logsumexp
from scipy.stats import norm

from identification.gap.design.experiment import (
    Posterior,
    Rivals,
    gaussians,
    outlooks,
    posteriors,
    rivals_of,
)
from identification.gap.design.information_gain import divergences, odds, outlook
from identification.gap.fit.fitter import Fitter, frames
from identification.gap.fit.variable_projection import Linear, normal
from identification.gap.model.grey_box import Cause, Channel, Nuisance, Run, Size
from identification.gap.rank.evidence import FORM_ERRORS
from identification.gap.rank.ranking import Verdicts, which

NOISE, SAMPLES, PERIOD = 0.02, 40, 1e-3
SUPPLIES = (12.0, 10.0, 8.0, 6.0, 4.0)
TRUTH = {"gain": 0.7, "offset": 0.1}


class Gauge:
    """y = gain u + offset + bend min(u, 8)/8: above a supply u of 8 the two causes are the same."""

    channels = (Channel(name="y", unit="1", scale=1.0, noise=NOISE),)
    parameters = (Size(symbol="gain", unit="1", low=0.1, high=2.0, off=0.6, scale=0.6),)
    tolerances = (Nuisance(symbol="curve", sd=5e-4, step=5e-4),)
    starts = (Nuisance(symbol="zero", sd=0.01, step=0.01),)
    equations = ()

    def __init__(self, supplies: Sequence[float], *, exact: bool, seed: int | None = None):
        """Runs in which the supply falls by 1; seed: of their noise, None: nothing measured yet."""
        self.causes = tuple(
            Cause(name=name, component="", sizes=(_size(name),), exact=exact)
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

    def forced(self, values, equation, run, edges):
        """`GreyBox.forced`: never, without equations."""
        raise NotImplementedError


def _size(name: str) -> Size:
    return Size(symbol=name, unit="1", low=-3.0, high=3.0, trials=(0.1,), scale=0.1)


def response(values: Mapping[str, NDArray], u: NDArray) -> NDArray:
    """Outputs (samples, n)."""
    n = max(len(value) for value in values.values())
    p = {s: values.get(s, np.zeros(n)) for s in ("gain", "offset", "bend", "curve", "zero")}
    line = np.outer(u, p["gain"]) + p["offset"] + np.outer(u**2, p["curve"])
    return line + np.outer(np.minimum(u, 8.0) / 8.0, p["bend"]) + p["zero"]


@cache
def diagnosed(exact: bool) -> Verdicts:
    """A gauge that is off, recorded under high supplies only."""
    return which(Gauge((12.0, 10.0, 11.0, 12.5, 9.5), exact=exact, seed=4))


def two(found: Verdicts) -> Rivals:
    """The two causes alone."""
    points = {candidate.point.hypothesis.name: candidate.point for candidate in found.candidates}
    return Rivals(points=(points["offset",], points["bend",]), probability=(0.55, 0.45))


def test_causes_that_differ_under_a_low_supply_only_are_split_there():
    found = diagnosed(exact=False)
    rivals = two(found)
    promised = outlooks(found.fitter, Gauge(SUPPLIES, exact=False), rivals)
    best = [outlook.best for outlook in promised]
    assert best[:2] == pytest.approx([0.55, 0.55], abs=0.01)
    assert np.argmin([outlook.doubt for outlook in promised]) == SUPPLIES.index(4.0)
    assert best[-1] > best[-2] > best[-3] > 0.56
    assert best[-1] > 0.8


@pytest.mark.parametrize("supply", [12.0, 7.0, 4.0])
def test_the_odds_come_true(supply):
    """Recordings by plants drawn from each rival's posterior, with noise, judged with the campaign."""
    found = diagnosed(exact=True)
    rivals = rivals_of(found)
    assert set(rivals.names) == {"offset", "bend", "no cause"}
    plan = Gauge((supply,), exact=True)
    promised = outlooks(found.fitter, plan, rivals)[0]
    counted = judged(found.fitter, plan, rivals, count=300)
    assert promised.after == pytest.approx(counted, abs=4 * 0.3 / np.sqrt(300))


def judged(fitter: Fitter, plan: Gauge, rivals: Rivals, count: int) -> tuple[float, ...]:
    """Mean probability of each rival over recordings that it made."""
    rng = np.random.default_rng(9)
    predicting = Fitter(
        plan, frames(Fitter(plan), rivals.points[:1], [np.zeros(len(plan.tolerances))])[0]
    )
    planned = [replace(point, frame=None) for point in rivals.points]
    predicted = [lines[0] for lines in predicting.linearise(planned, [0])]
    campaign = fitter.linearise(rivals.points, fitter.fitted)
    found = []
    for right, (point, known) in enumerate(
        zip(rivals.points, posteriors(fitter, rivals.points), strict=True)
    ):
        k = len(point.vector)
        drawn = known.mean + rng.standard_normal((count, len(known.mean))) @ known.factor.T
        sizes = (*plan.parameters, *point.hypothesis.sizes)
        scaled = (point.vector + drawn[:, :k]).T
        values = {size.symbol: column * size.scale for size, column in zip(sizes, scaled, strict=True)}
        values["curve"] = plan.tolerances[0].sd * drawn[:, k]
        values["zero"] = plan.starts[0].sd * rng.standard_normal(count)
        clean = response(values, plan.runs[0].inputs["u"]).T
        own = []
        before = np.log(rivals.probability) - [log_evidence(old) for old in campaign]
        for seen in (clean + rng.normal(0.0, NOISE, clean.shape)) / NOISE:
            scores = before + [
                log_evidence([*old, replace(new, residual=seen + new.residual)])
                for old, new in zip(campaign, predicted, strict=True)
            ]
            own.append(np.exp(scores[right] - logsumexp(scores)))
        found.append(float(np.mean(own)))
    return tuple(found)


def log_evidence(runs: Sequence[Linear]) -> float:
    """Of linearised runs, all numbers integrated out but for a constant."""
    together = [
        replace(run, slopes=np.column_stack([run.slopes, run.shared]), shared=np.zeros((SAMPLES, 0)))
        for run in runs
    ]
    found = normal(together)
    k = runs[0].slopes.shape[1]
    hessian = found.hessian + np.diag([0.0] * k + [1.0] * (len(found.hessian) - k))
    gain = found.gradient @ np.linalg.solve(hessian, found.gradient)
    return float(-0.5 * (found.chi_square - gain + np.linalg.slogdet(hessian)[1]))


def test_predictions_are_those_of_the_whole_covariances():
    """In the coordinates of `gaussians` densities differ as they do over all samples."""
    rng = np.random.default_rng(0)
    channels, samples, period = 2, 23, 1e-3
    n = channels * samples
    runs = [
        Linear(
            residual=rng.normal(size=n), slopes=rng.normal(size=(n, 2)), local=rng.normal(size=(n, 3)),
            local_value=np.zeros(3), local_sd=np.array([0.3, 2.0, 1.0]), shared=rng.normal(size=(n, 4)),
        )
        for _ in range(3)
    ]  # fmt: skip
    known = [Posterior(mean=rng.normal(size=6), factor=rng.normal(size=(6, 6))) for _ in runs]
    effects = 20 * rng.normal(size=(n, 2))
    number = np.concatenate([np.arange(samples) // 5, 100 + np.arange(samples) // 5])
    noise = np.eye(n)
    for effect in effects.T * max(FORM_ERRORS):
        noise += np.outer(effect, effect) * (number[:, None] == number) / 3
    whole = []
    means = []
    for line, own in zip(runs, known, strict=True):
        numbers = np.column_stack([line.slopes, line.shared])
        means.append(numbers @ own.mean - line.residual)
        columns = numbers @ own.factor
        local = line.local * line.local_sd
        whole.append(np.linalg.cholesky(noise + columns @ columns.T + local @ local.T))
    expected = divergences(np.stack(means), np.stack(whole))
    own_means, covariances = gaussians(runs, known, effects, channels, period)
    found = divergences(own_means, np.linalg.cholesky(covariances))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("distance", [0.0, 0.5, 2.0, 4.0])
@pytest.mark.parametrize("first", [0.5, 0.55, 0.9])
def test_the_outlook_of_two_rivals_has_the_closed_form(distance, first):
    """Log Bayes factors of two Gaussians: mean half the squared distance, variance that distance."""
    found = outlook(np.array([[0.0], [distance]]), np.ones((2, 1, 1)), (first, 1 - first))
    prior = np.log(first / (1 - first))

    def expected(what, sign):
        return quad(
            lambda z: norm.pdf(z) * what(sign * prior + 0.5 * distance**2 + distance * z), -9, 9
        )[0]

    assert found.after == pytest.approx((expected(expit, 1), expected(expit, -1)), abs=0.02)
    best = [expected(lambda x: max(expit(x), expit(-x)), sign) for sign in (1, -1)]
    assert found.best == pytest.approx(first * best[0] + (1 - first) * best[1], abs=0.02)
    assert found.log_bayes_factor[0, 1] == pytest.approx(0.5 * distance**2)


def test_an_experiment_that_shows_nothing_leaves_the_odds():
    before = (0.5, 0.3, 0.2)
    found = outlook(np.zeros((3, 2)), np.stack([np.diag([1.0, 4.0])] * 3), before)
    assert found.after == pytest.approx(before)
    assert found.best == pytest.approx(0.5)
    assert found.doubt == pytest.approx(-np.sum(np.array(before) * np.log(before)))
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
    promised = outlooks(found.fitter, Failing((4.0, 4.0), exact=True), rivals)
    assert promised[1].best == pytest.approx(0.55)
    assert promised[0].best > 0.8


def test_rivals_are_the_most_probable_hypotheses():
    rivals = rivals_of(diagnosed(exact=True))
    assert 2 <= len(rivals.points) <= 4
    assert sum(rivals.probability) == pytest.approx(1.0)
    assert list(rivals.probability) == sorted(rivals.probability, reverse=True)


@pytest.mark.parametrize(
    ("probability", "text"), [(0.5, "50:50"), (0.976, "98:2"), (0.999, "better than 99:1")]
)
def test_odds_are_in_a_hundred(probability, text):
    assert odds(probability) == text
