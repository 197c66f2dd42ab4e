"""Every printed figure of the report that can be checked against its others."""

from dataclasses import asdict
from typing import Any

from identification.report.page import Table
from identification.studies.reproduction.error_table_errata import error_findings
from identification.studies.reproduction.finding import SLIP, Finding
from identification.studies.reproduction.noise_errata import noise_findings
from identification.studies.reproduction.parameter_errata import parameter_findings


def findings() -> list[Finding]:
    """All checks in the order of the report's sections, those that hold included."""
    return [*noise_findings(), *parameter_findings(), *error_findings()]


def slips() -> list[Finding]:
    """Those where printed figures contradict each other."""
    return [finding for finding in findings() if finding.status == SLIP]


def as_json() -> list[dict[str, Any]]:
    """All checks, JSON-ready."""
    return [asdict(finding) for finding in findings()]


def findings_table(caption: str = "The report's printed figures checked against each other.") -> Table:
    """All checks for the HTML report, slips first, then doubts."""
    order = {"slip": 0, "doubt": 1, "holds": 2}
    rows = sorted(findings(), key=lambda finding: order[finding.status])
    return Table(
        columns=["Where", "status", "printed", "recomputed", "remark"],
        rows=[[row.where, row.status, row.printed, row.recomputed, row.remark] for row in rows],
        caption=caption,
    )
