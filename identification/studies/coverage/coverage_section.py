"""The coverage study in the report: how often each kind of interval holds the truth."""

from typing import Any

import numpy as np

from identification.report.page import Picture, Section, Table, Verdict
from identification.studies.coverage.coverage import Coverage, share
from identification.studies.coverage.coverage_figure import distances


def coverage_section(coverage: Coverage) -> Section:
    """What share of twin campaigns each kind of interval holds the truth in."""
    return Section(
        title=f"Coverage over {len(coverage.distance)} twin campaigns",
        verdicts=[_covers(coverage)],
        blocks=[
            _coverage_table(coverage),
            Picture(
                figure=distances(coverage),
                caption="Distances of the truth; points on the line: the region means what it says.",
            ),
        ],
    )


def coverage_json(coverage: Coverage) -> dict[str, Any]:
    """Shares with their 95 % intervals."""
    return {name: dict(zip(("share", "low", "high"), values, strict=True)) for name, values in
            _shares(coverage).items()}  # fmt: skip


def _shares(coverage: Coverage) -> dict[str, tuple[float, float, float]]:
    found = {
        "joint region": share(coverage.joint),
        "joint region if residuals were independent and inputs exact": share(coverage.joint_independent),
        "joint region by eq. 23": share(coverage.report_joint),
        "Nelder-Mead estimate inside the joint region": share(coverage.agree),
    }
    for i, symbol in enumerate(coverage.symbols):
        found[f"interval of {symbol}"] = share(coverage.inside[:, i])
        found[f"eq. 23's interval of {symbol}"] = share(coverage.report_inside[:, i])
    return found


def _covers(coverage: Coverage) -> Verdict:
    joint, low, high = share(coverage.joint)
    printed = np.mean(coverage.report_inside)
    return Verdict(
        status="good" if low <= 0.95 <= high else "bad",
        text=f"The joint 95 % region holds the truth in {100 * joint:.1f} % of the campaigns (95 % "
        f"interval of this share: {100 * low:.1f} to {100 * high:.1f} %); the report's intervals (eq. "
        f"23) hold their parameter in {100 * printed:.1f} % of the cases.",
    )


def _coverage_table(coverage: Coverage) -> Table:
    rows = [
        [name, *(f"{100 * value:.1f}" for value in values)] for name, values in _shares(coverage).items()
    ]
    columns = ["", "share [%]", "low", "high"]
    return Table(columns=columns, rows=rows, caption="Share of campaigns, with its exact 95 % interval.")
