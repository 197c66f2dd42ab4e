"""Every printed figure of the report that can be checked against the report's other figures."""

from dataclasses import asdict
from typing import Any

from identification.report.page import Section, Table, Verdict
from identification.studies.reproduction.error_table_errata import error_table_checks
from identification.studies.reproduction.figure_check import (
    CHECK_DEFAULTS,
    ERRATUM,
    STATUS_LABELS,
    CheckSettings,
    FigureCheck,
)
from identification.studies.reproduction.noise_errata import noise_checks
from identification.studies.reproduction.parameter_errata import parameter_checks


def figure_checks(settings: CheckSettings = CHECK_DEFAULTS) -> list[FigureCheck]:
    """All checks in the order of the report's sections, those that hold included."""
    return [*noise_checks(settings), *parameter_checks(settings), *error_table_checks(settings)]


def errata() -> list[FigureCheck]:
    """The checks in which printed figures contradict each other."""
    return [check for check in figure_checks() if check.status == ERRATUM]


def errata_json() -> list[dict[str, Any]]:
    """All checks, JSON-ready: the field `slips` of reproduce.json."""
    return [asdict(check) for check in figure_checks()]


def errata_section() -> Section:
    """The errata as one verdict, and all checks as a table, for the HTML report."""
    found = errata()
    text = f"{len(found)} printed figures contradict others: " + "; ".join(
        f"{erratum.where}: printed {erratum.printed}, recomputed {erratum.recomputed}"
        for erratum in found
    )
    return Section(
        title="Errata of the report",
        verdicts=[Verdict(status="note", text=text + ".")],
        blocks=[checks_table()],
    )


def checks_table() -> Table:
    """All checks, errata first, then doubts."""
    order = list(STATUS_LABELS)
    rows = sorted(figure_checks(), key=lambda check: order.index(check.status))
    return Table(
        columns=["Where", "status", "printed", "recomputed", "remark"],
        rows=[
            [row.where, STATUS_LABELS[row.status], row.printed, row.recomputed, row.remark]
            for row in rows
        ],
        caption="The report's printed figures checked against each other.",
    )
