"""Acceptance criteria of a learned controller, and whether the controller meets them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from epv_env.reward import RewardWeights
from training.evaluation.metrics import EpisodeMetrics, summary, violation_interval
from training.evaluation.scenarios import RANDOM
from training.studies.comparison.contenders import CRITERIA_ON, Contender
from training.studies.comparison.score_tables import JUDGED_ON, ComparisonResults

ORACLE = "oracle"
"""Contender that shows what is physically possible; others that see the plant are no measure."""

JUDGED = {"C2_largest_breakdown_bar": "largest breakdown", "rms_error_bar": "rms error"}
"""Figures in which the learned controller has to be best."""


@dataclass(frozen=True, kw_only=True)
class AcceptanceSettings:
    """Limits of the acceptance criteria."""

    violation_limits: Mapping[str, float] = field(
        default_factory=lambda: {"confidence": 1e-3, "sensitive_ten_percent": 1e-2}
    )
    """Largest upper 95 % bound of the violation rate [1], by plant set: a valve as identified must
    hardly ever fail, and one that is up to 10 % off in every sensitive parameter seldom."""
    oracle_factor: float = 1.5
    """Largest factor over the oracle's figures [1]: the oracle knows the plant and the consumption."""


SETTINGS = AcceptanceSettings()


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """One requirement of a learned controller, and whether the controller meets it."""

    controller: str
    requirement: str
    measured: str
    met: bool

    def as_record(self) -> dict[str, str | bool]:
        """The criterion as results.json has it, where the requirement is called `bar`."""
        return {
            "controller": self.controller, "bar": self.requirement, "measured": self.measured,
            "met": self.met,
        }  # fmt: skip


def criteria(
    c: ComparisonResults, ours: Contender, settings: AcceptanceSettings = SETTINGS
) -> list[Criterion]:
    """All requirements on the chosen run of `ours`; random scenario, full sensor noise."""
    limits = settings.violation_limits.items()
    criteria = [violation_criterion(c, ours, plants, limit) for plants, limit in limits]
    for rival in c.contenders:
        if rival.name == ORACLE:
            criteria += against_oracle(c, ours, rival, factor=settings.oracle_factor)
        elif not (rival.learned or rival.privileged):
            criteria += against_rival(c, ours, rival)
    return criteria


def violation_criterion(c: ComparisonResults, ours: Contender, plants: str, limit: float) -> Criterion:
    """The bound on the violation rate, and how many training seeds keep it."""
    stayed = c.metrics(ours.name, plants).stayed
    upper = violation_interval(stayed)[1]
    keep = sum(
        violation_interval(c.results[run, plants, RANDOM].stayed)[1] <= limit for run in ours.runs
    )
    return Criterion(
        controller=ours.name,
        requirement=f"upper 95 % bound of leaving ±500 mbar at most {100 * limit:g} %, {plants}",
        measured=f"{100 * upper:.3f} % ({int((~stayed).sum())} of {len(stayed)} episodes left; "
        f"{keep} of {len(ours.runs)} training seeds keep it)",
        met=upper <= limit,
    )


def against_rival(c: ComparisonResults, ours: Contender, rival: Contender) -> Iterator[Criterion]:
    """Figures below the rival's at equal or fewer switches, on the calibrated plant.

    For ours at the price of switching at which it switches most among those at which it switches no more
    than the rival; if there is none, at its own.
    """
    names, runs = zip(*c.at_prices(ours).values(), strict=True)
    its, *own = _figures(c, c.chosen[rival.name], *runs)
    at = dict(zip(names, own, strict=True))
    fewer = [n for n, m in at.items() if m["switchings_per_s"] <= its["switchings_per_s"]]
    name = max(fewer, key=lambda n: at[n]["switchings_per_s"], default=ours.name)
    mine = at[name]
    switching = f"switchings {mine['switchings_per_s']:.2f} against {its['switchings_per_s']:.2f} /s"
    for figure, meaning in JUDGED.items():
        yield Criterion(
            controller=name,
            requirement=f"{meaning} below that of {rival.name}, at equal or fewer switches, calibrated",
            measured=f"{1e3 * mine[figure]:.0f} against {1e3 * its[figure]:.0f} mbar, {switching}",
            met=mine[figure] < its[figure] and mine["switchings_per_s"] <= its["switchings_per_s"],
        )


def against_oracle(
    c: ComparisonResults,
    ours: Contender,
    oracle: Contender,
    *,
    factor: float = SETTINGS.oracle_factor,
) -> Iterator[Criterion]:
    """Figures near what is physically possible, on the calibrated plant.

    For ours, and for ours where switching costs least: against the oracle, and that one's at this price.
    """
    at, limits = c.at_prices(ours), c.at_prices(oracle)
    own, least = RewardWeights().switching, min(at)
    for price, limit in dict.fromkeys([(own, own), (least, own), (least, least)]):
        if limit in limits:
            yield from _near(c, at[price], limits[limit], factor)


def _near(
    c: ComparisonResults, ours: tuple[str, str], oracle: tuple[str, str], factor: float
) -> Iterator[Criterion]:
    """Whether the figures of one run stay within `factor` times the other's, each by name and run."""
    mine, its = _figures(c, ours[1], oracle[1])
    switching = f"switchings {mine['switchings_per_s']:.2f} against {its['switchings_per_s']:.2f} /s"
    for figure, meaning in JUDGED.items():
        yield Criterion(
            controller=ours[0],
            requirement=f"{meaning} within {factor:g} times that of {oracle[0]}, calibrated",
            measured=f"{1e3 * mine[figure]:.0f} against {1e3 * its[figure]:.0f} mbar, {switching}",
            met=mine[figure] <= factor * its[figure],
        )


def _figures(c: ComparisonResults, *runs: str) -> list[dict[str, float]]:
    """Of random episodes on CRITERIA_ON that all these runs have run."""
    metrics = [c.results[run, CRITERIA_ON, RANDOM] for run in runs]
    fewest = min(map(len, metrics))
    return [summary(m.first(fewest)) for m in metrics]


def _common(
    c: ComparisonResults, ours: Contender, rival: Contender, plants: str, scenario: str
) -> list[EpisodeMetrics]:
    """The episodes that both have run."""
    both = [c.metrics(name, plants, scenario) for name in (ours.name, rival.name)]
    fewest = min(map(len, both))
    return [m.first(fewest) for m in both]


def lost_to_model_based(c: ComparisonResults, ours: Contender) -> list[dict[str, str | float]]:
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
