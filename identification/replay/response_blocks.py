"""Measured and modelled responses in a report: tables of errors, and figures over time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.replay import Response, total_response_error
from identification.report.page import Table


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


MEASURED = {"color": "tab:blue", "alpha": 0.35, "linewidth": 3.0, "label": "measured"}
"""Line of a measured signal."""

MODEL = {"color": "tab:red", "linewidth": 0.8, "label": "model"}
"""Line of a modelled signal."""


def response_figure(response: Response) -> Figure:
    """Voltage, and the measured outputs with the model's over them (Figures 10 to 14)."""
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    rows = figure.subplots(len(OUTPUTS) + 1, 1, sharex=True, height_ratios=[0.6, 1, 1, 1])
    time = response.recording.time
    rows[0].plot(time, response.recording.U, color="tab:blue", linewidth=0.8)
    rows[0].set_ylabel("U [V]")
    for axes, output, measured, model in zip(
        rows[1:], OUTPUTS, response.measured, response.model, strict=True
    ):
        unit, size = UNITS[output]
        axes.plot(time, measured / size, **MEASURED)
        axes.plot(time, model / size, **MODEL)
        axes.set_ylabel(f"{output} [{unit}]")
        axes.grid(alpha=0.3)
    rows[1].legend(loc="best", fontsize="small")
    rows[-1].set_xlabel("time [s]")
    figure.suptitle(response.recording.name)
    figure.align_ylabels()
    return figure


def error_figure(responses: Sequence[Response]) -> Figure:
    """Model error relative to each output's mean, as eq. 19 weighs it (Figure 15)."""
    figure = Figure(figsize=(9, 1.9 * len(OUTPUTS) + 0.6), layout="constrained")
    rows = figure.subplots(len(OUTPUTS), 1, sharex=True)
    for index, (axes, output) in enumerate(zip(rows, OUTPUTS, strict=True)):
        for response in responses:
            error = response.model[index] - response.measured[index]
            relative = 100.0 * error / np.mean(response.measured[index])
            axes.plot(response.recording.time, relative, linewidth=0.6, label=response.recording.name)
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylabel(f"{output}: model - measured\n[% of the mean]")
        axes.grid(alpha=0.3)
    rows[0].legend(loc="upper right", fontsize="small", ncols=3)
    rows[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    return figure
