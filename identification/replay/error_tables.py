"""Tables of the report's error terms, ready to read."""

from collections.abc import Mapping, Sequence
from typing import Any

from identification.recordings.recording import OUTPUTS
from identification.replay.responses import Response, total_response_error
from identification.report.page import Table

COLUMNS = ["Case", *(f"eps_{output} [%]" for output in OUTPUTS), "eps_partial [%]"]
"""Headings of an error table."""

MEANING = "Mean distance of model and recording, in percent of the recording's mean."
"""What an error is."""


def error_table(responses: Sequence[Response], caption: str, printed: str) -> Table:
    """Eqs 19 and 20 by recording, and eq. 21 over all; printed: the report's table of the like."""
    rows = [
        [response.recording.name, *map(percent, response.errors.values()), percent(response.partial)]
        for response in responses
    ]
    if len(responses) > 1:
        rows.append(["all (eps_total)", "", "", "", percent(total_response_error(responses))])
    return Table(columns=COLUMNS, rows=rows, caption=f"{caption} {MEANING}", printed=printed)


def errors_as_json(responses: Sequence[Response]) -> Mapping[str, Any]:
    """The same in percent, with the field names of the report's tables."""
    errors: dict[str, Any] = {
        response.recording.name: {
            **{f"eps_{output}": 100 * error for output, error in response.errors.items()},
            "eps_partial": 100 * response.partial,
        }
        for response in responses
    }
    return {**errors, "eps_total": 100 * total_response_error(responses)}


def percent(fraction: float) -> str:
    """A fraction as the report prints errors, in percent."""
    return f"{100 * fraction:.4f}"
