"""Measured and modelled responses in a report: tables of errors, and a figure over time."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.replay import Response, total_response_error
from identification.report.page import Picture, Table, over_time


def error_table(responses: Sequence[Response], caption: str) -> Table:
    """Eqs 19 and 20 by recording, and eq. 21 over all."""
    rows = [
        [response.recording.name, *map(percent, response.errors.values()), percent(response.partial)]
        for response in responses
    ]
    if len(responses) > 1:
        rows.append(["all (eps_total)", "", "", "", percent(total_response_error(responses))])
    return Table(
        columns=["Case", *(f"eps_{output} [%]" for output in OUTPUTS), "eps_partial [%]"],
        rows=rows,
        caption=f"{caption} Mean distance of model and recording, in percent of the recording's mean.",
    )


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


def response_figure(response: Response) -> Figure:
    """Voltage, and the measured outputs with the model's over them (Figures 10 to 14)."""
    rows = {"U [V]": {"voltage": response.recording.U}}
    for output, measured, model in zip(OUTPUTS, response.measured, response.model, strict=True):
        unit, size = UNITS[output]
        rows[f"{output} [{unit}]"] = {"measured": measured / size, "model": model / size}
    return over_time(response.recording.time, rows, [0.6, 1.0, 1.0, 1.0])


def worst_picture(responses: Sequence[Response]) -> Picture:
    """The response with the greatest partial error (eq. 20)."""
    worst = max(responses, key=lambda response: response.partial)
    caption = f"The recording with the greatest error: {worst.recording.name}."
    return Picture(figure=response_figure(worst), caption=caption)
