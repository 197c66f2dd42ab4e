"""Regions draw plants: from boxes inside the domains, or uniformly from a joint ellipsoid."""

from functools import cache
from itertools import product

import numpy as np
import pytest

from epv_env.plant.parameters import (
    ParameterError,
    Parameters,
    confidence_intervals,
    sensitive_symbols,
    table,
)
from epv_env.plant.region import CALIBRATED_SYMBOLS, REGIONS, Alternative, Mixture, Region

CENTRE = Parameters.calibrated()
CHI_SQUARE = 9.49
SYMBOLS = ("alphaMV", "alphaPV", "kPV", "R")
DEVIATIONS = np.array([0.01, 0.005, 0.3, 0.5])
CORRELATIONS = np.array(
    [[1.0, 0.9, -0.3, 0.0], [0.9, 1.0, 0.0, 0.0], [-0.3, 0.0, 1.0, 0.5], [0.0, 0.0, 0.5, 1.0]]
)
COVARIANCE = DEVIATIONS[:, None] * CORRELATIONS * DEVIATIONS


def domain(symbol):
    """Ends of a symbol's domain; a constant's is its value."""
    return table()[symbol].domain or (CENTRE[symbol], CENTRE[symbol])


def joint(covariance=COVARIANCE, symbols=SYMBOLS):
    return Region(centre=CENTRE, symbols=symbols, covariance=covariance, chi_square=CHI_SQUARE)


def offsets(region, n):
    """Drawn joint symbols minus the centre, (n, k)."""
    rng = np.random.default_rng(0)
    drawn = [region.draw(rng) for _ in range(n)]
    return np.array([[p[symbol] - CENTRE[symbol] for symbol in region.symbols] for p in drawn])


@cache
def standard_offsets():
    """Draws of the joint region in units of the deviations, (4000, 4)."""
    return offsets(joint(), 4000) / DEVIATIONS


def test_named_regions_stay_inside_the_domains():
    for name, centre in product(REGIONS, (CENTRE, Parameters.nominal(), Parameters.initial_guess())):
        for symbol, (low, high) in Region.named(name, centre).boxes.items():
            first, last = domain(symbol)
            assert first <= low <= centre[symbol] <= high <= last, (name, symbol)


def test_confidence_is_table_14_around_table_12():
    boxes = Region.named("confidence", CENTRE).boxes
    for symbol, ends in confidence_intervals().items():
        assert boxes[symbol] == pytest.approx(ends, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "symbols"),
    [("ten_percent", CALIBRATED_SYMBOLS), ("sensitive_ten_percent", sensitive_symbols())],
)
def test_ten_percent_is_ten_percent_cut_at_the_domain(name, symbols):
    boxes = Region.named(name, CENTRE).boxes
    assert set(boxes) == set(symbols)
    for symbol, (low, high) in boxes.items():
        first, last = domain(symbol)
        expected = max(0.9 * CENTRE[symbol], first), min(1.1 * CENTRE[symbol], last)
        assert (low, high) == pytest.approx(expected, rel=1e-12)


def test_joint_draws_fill_their_ellipsoid_uniformly():
    """The volume inside a Mahalanobis radius r goes with r^4, so (d2/chi2)^2 is uniform on [0, 1]."""
    change = standard_offsets()
    squared = np.einsum("ni,ij,nj->n", change, np.linalg.inv(CORRELATIONS), change)
    assert np.max(squared) <= CHI_SQUARE * (1 + 1e-9)
    share = np.sort((squared / CHI_SQUARE) ** 2)
    assert np.max(np.abs(share - (np.arange(len(share)) + 0.5) / len(share))) < 0.03


def test_joint_draws_stay_inside_the_domains():
    for p in (joint(400 * COVARIANCE).draw(np.random.default_rng(seed)) for seed in range(300)):
        for symbol in SYMBOLS:
            low, high = domain(symbol)
            assert low <= p[symbol] <= high


def mixture(*probabilities):
    """As many alternatives; that number k has an eddy current of (k + 1) mS and the joint region."""
    regions = [
        Region(
            centre=CENTRE.replace(G_eddy=1e-3 * (k + 1)), symbols=SYMBOLS, covariance=COVARIANCE,
            chi_square=CHI_SQUARE,
        )
        for k in range(len(probabilities))
    ]  # fmt: skip
    return Mixture(
        alternatives=tuple(
            Alternative(name=str(k), probability=p, region=region)
            for k, (p, region) in enumerate(zip(probabilities, regions, strict=True))
        )
    )


def test_a_mixture_draws_its_alternatives_as_often_as_they_are_probable_each_in_its_region():
    rng, n = np.random.default_rng(0), 6000
    chosen = mixture(0.6, 0.3, 0.1)
    drawn = [chosen.chosen(rng).draw(rng) for _ in range(n)]
    which = np.array([round(plant["G_eddy"] / 1e-3) - 1 for plant in drawn])
    shares = np.array([0.6, 0.3, 0.1])
    assert np.all(np.abs(np.bincount(which) / n - shares) < 4 * np.sqrt(shares * (1 - shares) / n))
    offset = np.array([[plant[s] - CENTRE[s] for s in SYMBOLS] for plant in drawn])[which == 1]
    # A uniform 4-ball of radius r has the variance r^2 / 6 along each axis.
    found = np.cov(offset.T) / np.outer(DEVIATIONS, DEVIATIONS) * 6 / CHI_SQUARE
    np.testing.assert_allclose(found, CORRELATIONS, atol=0.1)


def test_what_is_chosen_for_a_symbol_replaces_every_way_in_which_it_varied():
    for region in (joint(), mixture(0.5, 0.5)):
        rng = np.random.default_rng(0)
        changed = region.changed({"R": 41.0, "kPV": (10.0, 10.5), "G_eddy": 0.0})
        drawn = [changed.chosen(rng).draw(rng) for _ in range(50)]
        assert {(plant["R"], plant["G_eddy"]) for plant in drawn} == {(41.0, 0.0)}
        assert all(10.0 <= plant["kPV"] <= 10.5 for plant in drawn)
        assert len({plant["alphaMV"] for plant in drawn}) == 50


@pytest.mark.parametrize("wrong", [(), (0.5, 0.4), (1.0, 0.0), (np.nan,), (1.5, -0.5)])
def test_probabilities_that_are_none_are_refused(wrong):
    with pytest.raises(ParameterError, match=r"sum|above 0"):
        mixture(*wrong)


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"x": 1.0}, "unknown parameter 'x': known symbols are"),
        ({"R": 10.0}, "R = 10 Ohm is outside its domain"),
        ({"R": (10.0, 40.0)}, "R = 10 Ohm is outside its domain"),
        ({"R": (42.0, 41.0)}, r"range of R is \[42, 41\]: give low <= high"),
        ({"R": (1.0,)}, r"range of R is .*: give \(low, high\)"),
        ({"R": None}, "parameter R is None: give one number"),
    ],
    ids=str,
)
def test_a_bad_choice_is_refused(choices, message):
    with pytest.raises(ParameterError, match=message):
        Region(centre=CENTRE).changed(choices)


@pytest.mark.parametrize(
    "wrong",
    [
        {"symbols": ("x",), "covariance": np.eye(1)},
        {"symbols": ("R",), "covariance": np.eye(1), "chi_square": -1.0},
        {"symbols": ("R",), "covariance": np.full((1, 1), np.nan)},
        {"symbols": ("R", "RML"), "covariance": np.array([[1.0, 0.5], [0.0, 1.0]])},
    ],
    ids=["unknown symbol", "negative radius", "not a number", "not symmetric"],
)
def test_a_bad_joint_region_is_refused(wrong):
    with pytest.raises(ParameterError):
        Region(**{"centre": CENTRE, "chi_square": CHI_SQUARE, **wrong})


def test_a_pressure_written_in_bar_is_refused_with_its_value_in_pascal():
    with pytest.raises(ParameterError, match=r"b_p2 = 0.256 is in Pa.* write 25600 if you"):
        Region(centre=CENTRE).changed({"b_p2": 0.256})
    with pytest.raises(ParameterError, match="write 25600"):
        Region(centre=CENTRE).changed({"b_p2": (0.0, 0.256)})
    assert Region(centre=CENTRE).changed({"b_p2": 25600.0, "b_p3": 0.0}).centre["b_p2"] == 25600.0
