"""The coverage study in the report: how often each kind of interval holds the truth."""

from typing import Any

import numpy as np

from identification.confidence.settings import CONFIDENCE
from identification.report.page import Picture, Section, Table, Verdict
from identification.studies.coverage.coverage import Coverage
from identification.studies.coverage.coverage_figure import distance_quantiles
from identification.studies.proportion import Proportion


def coverage_section(coverage: Coverage) -> Section:
    """The share of campaigns in which each kind of interval holds the truth."""
    return Section(
        title=f"Coverage over {len(coverage.distance)} twin campaigns",
        verdicts=[_joint_region_verdict(coverage)],
        blocks=[
            _coverage_table(coverage),
            Picture(
                figure=distance_quantiles(coverage),
                caption="Distances of the truth. If the points follow the line, the region covers the "
                "truth as often as it says.",
            ),
        ],
    )


def coverage_json(coverage: Coverage) -> dict[str, Any]:
    """Shares [-] by kind of interval, with the ends of their 95 % intervals."""
    return {
        name: dict(zip(("share", "low", "high"), _with_interval(proportion), strict=True))
        for name, proportion in _proportions(coverage).items()
    }


def _proportions(coverage: Coverage) -> dict[str, Proportion]:
    """Campaigns in which each kind of interval holds the truth; names as in coverage.json."""
    proportions = {
        "joint region": Proportion.count(coverage.joint),
        "joint region if residuals were independent and inputs exact": Proportion.count(
            coverage.joint_independent
        ),
        "joint region by eq. 23": Proportion.count(coverage.report_joint),
        "Nelder-Mead estimate inside the joint region": Proportion.count(coverage.agree),
    }
    for i, symbol in enumerate(coverage.symbols):
        proportions[f"interval of {symbol}"] = Proportion.count(coverage.inside[:, i])
        proportions[f"eq. 23's interval of {symbol}"] = Proportion.count(coverage.report_inside[:, i])
    return proportions


def _with_interval(proportion: Proportion) -> tuple[float, float, float]:
    """Value, low and high end [-] of a proportion that has cases."""
    return proportion.value or 0.0, *proportion.interval


def _joint_region_verdict(coverage: Coverage) -> Verdict:
    joint, low, high = _with_interval(Proportion.count(coverage.joint))
    printed = np.mean(coverage.report_inside)
    return Verdict(
        status="good" if low <= CONFIDENCE.probability <= high else "bad",
        text=f"The joint 95 % region holds the truth in {100 * joint:.1f} % of the campaigns (95 % "
        f"interval of this share: {100 * low:.1f} to {100 * high:.1f} %); the report's intervals (eq. "
        f"23) hold their parameter in {100 * printed:.1f} % of the cases.",
    )


def _coverage_table(coverage: Coverage) -> Table:
    rows = [
        [name, *(f"{100 * value:.1f}" for value in _with_interval(proportion))]
        for name, proportion in _proportions(coverage).items()
    ]
    columns = ["", "share [%]", "low", "high"]
    return Table(columns=columns, rows=rows, caption="Share of campaigns, with its exact 95 % interval.")
