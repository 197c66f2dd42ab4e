"""What the learned controller has to reach, what it reached, and whether that is enough."""

from collections.abc import Iterator
from dataclasses import dataclass

from epv_env.reward import RewardWeights
from training.evaluation.metrics import EpisodeMetrics, summary, violation_interval
from training.evaluation.scenarios import RANDOM
from training.studies.comparison.plan import BARS_ON, Contender
from training.studies.comparison.scores import JUDGED_ON, Contest

LEAVING = {"confidence": 1e-3, "sensitive_ten_percent": 1e-2}
"""Largest upper 95 % bound of the probability of leaving the band, by plant set."""

ORACLE = "oracle"
"""Contender that shows what is physically possible; others that see the plant are no measure."""

NEAR_ORACLE = 1.5
"""Largest factor over the oracle's figures."""

JUDGED = {"C2_largest_breakdown_bar": "largest breakdown", "rms_error_bar": "rms error"}
"""Figures in which the learned controller has to be best."""


@dataclass(frozen=True, kw_only=True)
class Bar:
    """One requirement of a learned controller."""

    controller: str
    bar: str
    measured: str
    met: bool


def bars(c: Contest, ours: Contender) -> list[Bar]:
    """All requirements on the chosen run of `ours`; random scenario, full sensor noise."""
    found = [leaving(c, ours, plants, limit) for plants, limit in LEAVING.items()]
    for rival in c.contenders:
        if rival.name == ORACLE:
            found += against_oracle(c, ours, rival)
        elif not (rival.learned or rival.privileged):
            found += against_rival(c, ours, rival)
    return found


def leaving(c: Contest, ours: Contender, plants: str, limit: float) -> Bar:
    """The bound on the probability of leaving the band, and how many training seeds keep it."""
    stayed = c.metrics(ours.name, plants).stayed
    upper = violation_interval(stayed)[1]
    keep = sum(
        violation_interval(c.results[run, plants, RANDOM].stayed)[1] <= limit for run in ours.runs
    )
    return Bar(
        controller=ours.name,
        bar=f"upper 95 % bound of leaving ±500 mbar at most {100 * limit:g} %, {plants}",
        measured=f"{100 * upper:.3f} % ({int((~stayed).sum())} of {len(stayed)} episodes left; "
        f"{keep} of {len(ours.runs)} training seeds keep it)",
        met=upper <= limit,
    )


def against_rival(c: Contest, ours: Contender, rival: Contender) -> Iterator[Bar]:
    """Figures below the rival's at equal or fewer switches, on the calibrated plant.

    For ours at the price of switching at which it switches most among those at which it switches no more
    than the rival; if there is none, at its own.
    """
    names, runs = zip(*c.at_prices(ours).values(), strict=True)
    its, *found = _figures(c, c.chosen[rival.name], *runs)
    at = dict(zip(names, found, strict=True))
    fewer = [n for n, m in at.items() if m["switchings_per_s"] <= its["switchings_per_s"]]
    name = max(fewer, key=lambda n: at[n]["switchings_per_s"], default=ours.name)
    mine = at[name]
    switching = f"switchings {mine['switchings_per_s']:.2f} against {its['switchings_per_s']:.2f} /s"
    for figure, meaning in JUDGED.items():
        yield Bar(
            controller=name,
            bar=f"{meaning} below that of {rival.name}, at equal or fewer switches, calibrated",
            measured=f"{1e3 * mine[figure]:.0f} against {1e3 * its[figure]:.0f} mbar, {switching}",
            met=mine[figure] < its[figure] and mine["switchings_per_s"] <= its["switchings_per_s"],
        )


def against_oracle(c: Contest, ours: Contender, oracle: Contender) -> Iterator[Bar]:
    """Figures near what is physically possible, on the calibrated plant.

    For ours, and for ours where switching costs least: against the oracle, and that one's at this price.
    """
    at, limits = c.at_prices(ours), c.at_prices(oracle)
    own, least = RewardWeights().switching, min(at)
    for price, limit in dict.fromkeys([(own, own), (least, own), (least, least)]):
        if limit in limits:
            yield from _near(c, at[price], limits[limit])


def _near(c: Contest, ours: tuple[str, str], oracle: tuple[str, str]) -> Iterator[Bar]:
    """How near one run comes to another, each by its name and its run."""
    mine, its = _figures(c, ours[1], oracle[1])
    switching = f"switchings {mine['switchings_per_s']:.2f} against {its['switchings_per_s']:.2f} /s"
    for figure, meaning in JUDGED.items():
        yield Bar(
            controller=ours[0],
            bar=f"{meaning} within {NEAR_ORACLE:g} times that of {oracle[0]}, calibrated",
            measured=f"{1e3 * mine[figure]:.0f} against {1e3 * its[figure]:.0f} mbar, {switching}",
            met=mine[figure] <= NEAR_ORACLE * its[figure],
        )


def _figures(c: Contest, *runs: str) -> list[dict[str, float]]:
    """Of random episodes on BARS_ON that all these runs have run."""
    found = [c.results[run, BARS_ON, RANDOM] for run in runs]
    fewest = min(map(len, found))
    return [summary(m.first(fewest)) for m in found]


def _common(
    c: Contest, ours: Contender, rival: Contender, plants: str, scenario: str
) -> list[EpisodeMetrics]:
    """The episodes that both have run."""
    both = [c.metrics(name, plants, scenario) for name in (ours.name, rival.name)]
    fewest = min(map(len, both))
    return [m.first(fewest) for m in both]


def lost(c: Contest, ours: Contender) -> list[dict[str, str | float]]:
    """Where a model-based rival is better: a row per plant set, scenario and figure."""
    rows = []
    for rival in c.contenders:
        if not rival.model_based or rival.privileged:
            continue
        for plants in JUDGED_ON:
            for scenario in c.scenarios:
                mine, its = (summary(m) for m in _common(c, ours, rival, plants, scenario))
                rows += [
                    {
                        "rival": rival.name, "plants": plants, "scenario": scenario, "figure": meaning,
                        "ours_bar": mine[figure], "its_bar": its[figure],
                    }
                    for figure, meaning in JUDGED.items()
                    if its[figure] < mine[figure]
                ]  # fmt: skip
    return rows
