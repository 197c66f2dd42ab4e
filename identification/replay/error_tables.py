"""Tables of the report's error terms, ready to read."""

from collections.abc import Mapping, Sequence
from typing import Any

from identification.recordings.recording import OUTPUTS
from identification.replay.responses import Response, total_response_error
from identification.report.page import Table

COLUMNS = ["Case", *(f"eps_{output} [%]" for output in OUTPUTS), "eps_partial [%]"]


def error_table(answers: Sequence[Response], caption: str) -> Table:
    """Eqs 19 and 20 by recording, and eq. 21 over all, as in Tables 11, 13 and 15."""
    rows = [
        [answer.recording.name, *map(percent, answer.errors.values()), percent(answer.partial)]
        for answer in answers
    ]
    if len(answers) > 1:
        rows.append(["all (eps_total)", "", "", "", percent(total_response_error(answers))])
    return Table(columns=COLUMNS, rows=rows, caption=caption)


def errors_as_json(answers: Sequence[Response]) -> Mapping[str, Any]:
    """The same in percent, with the field names of the report's tables."""
    found: dict[str, Any] = {
        answer.recording.name: {
            **{f"eps_{output}": 100 * error for output, error in answer.errors.items()},
            "eps_partial": 100 * answer.partial,
        }
        for answer in answers
    }
    return {**found, "eps_total": 100 * total_response_error(answers)}


def percent(fraction: float) -> str:
    """A fraction as the report prints errors, in percent."""
    return f"{100 * fraction:.4f}"
