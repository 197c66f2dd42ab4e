"""Tables 10 to 15 of a virtual bench whose truth is Table 12, beside the printed ones."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from epv_env.plant.parameters import Parameters, confidence_intervals, table
from identification.calibration.multi_start import METHODS
from identification.pipeline.identification import Identification
from identification.recordings.recording import OUTPUTS
from identification.replay.error_tables import errors_as_json, percent
from identification.replay.responses import Response, responses, total_response_error
from identification.report.page import Section, Table, Text, Verdict
from identification.report_2003.printed_values import printed_errors, printed_total

LIMITS_OF_REPRODUCTION = (
    "The measured data behind Tables 11, 13 and 15 was never published. The virtual bench obeys the "
    "model, so calibration takes its errors down to the sensors' noise; the report's 6.6 % (mostly of "
    "the current) cannot come back: it is what the real valve did and the model does not. Table 14's "
    "intervals are of that bench too. Tables 2 to 4 are reproduced in kind: the bench's sensors have "
    "the printed offsets, trends and standard deviations, and normal, white, independent noise."
)


def bench_section(identification: Identification) -> Section:
    """Table 12 found again, and the errors before, after and on the held-out test."""
    rows = _error_rows(identification)
    return Section(
        title="Tables 10 to 15 on a virtual bench with Table 12 as truth",
        verdicts=[_truth_recovered(identification)],
        blocks=[
            Text(text=LIMITS_OF_REPRODUCTION),
            _estimates_table(identification),
            Table(
                columns=[
                    "Table", "case", *(f"eps_{output} [%]" for output in OUTPUTS), "eps_partial [%]",
                    "the report's eps_partial [%]",
                ],
                rows=rows,
                caption="Errors (eqs 19-21) at Table 10, after Nelder-Mead, and on the held-out test.",
            ),
        ],
    )  # fmt: skip


def bench_json(identification: Identification) -> dict[str, Any]:
    """Tables 10 to 15 of the virtual bench; parameters in SI units, errors in percent."""
    calibration, confidence = identification.calibration, identification.confidence
    symbols = identification.problem.vector.symbols
    return {
        "table10": {s: identification.problem.vector.reference[s] for s in symbols},
        "table11": errors_as_json(calibration.before),
        "table12": {m: {s: calibration.parameters(m)[s] for s in symbols} for m in METHODS},
        "table13": errors_as_json(calibration.after["Nelder-Mead"]),
        "table14": {
            "eq23": {s: list(ends) for s, ends in confidence.report_intervals().items()},
            "covering": {s: list(ends) for s, ends in confidence.intervals().items()},
        },
        "table15": errors_as_json(_validation_responses(identification)),
    }


def _validation_responses(identification: Identification) -> list[Response]:
    parameters = identification.calibration.parameters("Nelder-Mead")
    return responses(identification.problem.validation, parameters)


def _truth_recovered(identification: Identification) -> Verdict:
    confidence, vector = identification.confidence, identification.problem.vector
    deviation = confidence.estimate - vector.scaled(Parameters.calibrated())
    distance = float(deviation @ np.linalg.solve(confidence.covariance.total, deviation))
    inside = distance <= confidence.chi_square
    return Verdict(
        status="good" if inside else "doubt",
        text=f"Table 12, the truth, lies {'inside' if inside else 'outside'} the joint 95 % region of "
        f"the estimate (squared distance {distance:.3g}, limit {confidence.chi_square:.3g}); the region "
        "misses the truth once in twenty campaigns.",
    )


def _estimates_table(identification: Identification) -> Table:
    calibration, confidence = identification.calibration, identification.confidence
    truth, start = Parameters.calibrated(), Parameters.initial_guess()
    rows = [
        [
            f"{symbol} [{table()[symbol].unit}]",
            f"{start[symbol]:.7g}",
            f"{truth[symbol]:.7g}",
            *(f"{calibration.parameters(method)[symbol]:.7g}" for method in METHODS),
            _relative_width(confidence_intervals()[symbol], truth[symbol]),
            _relative_width(confidence.report_intervals()[symbol], truth[symbol]),
            _relative_width(confidence.intervals()[symbol], truth[symbol]),
        ]
        for symbol in identification.problem.vector.symbols
    ]
    columns = [
        "Parameter", "Table 10", "Table 12 (truth)", *METHODS, "width, Table 14 [%]",
        "width, eq. 23 [%]", "width, covering 95 % [%]",
    ]  # fmt: skip
    return Table(
        columns=columns, rows=rows, caption="Estimates (Tables 10, 12) and intervals (Table 14)."
    )


def _relative_width(interval: tuple[float, float], value: float) -> str:
    return f"{100 * (interval[1] - interval[0]) / value:.3g}"


def _error_rows(identification: Identification) -> list[list[str]]:
    calibration = identification.calibration
    return [
        *_table_rows("11", calibration.before),
        *_table_rows("13", calibration.after["Nelder-Mead"]),
        *_table_rows("15", _validation_responses(identification)),
    ]


def _table_rows(number: str, answers: Sequence[Response]) -> list[list[str]]:
    printed: Mapping[str, Any] = printed_errors(int(number))
    rows = []
    for answer, (case, errors) in zip(answers, printed.items(), strict=True):
        cells = [percent(error) for error in answer.errors.values()]
        rows.append([number, case, *cells, percent(answer.partial), f"{errors['partial']:.4f}"])
    if len(answers) > 1:
        total_printed = f"{printed_total(int(number)):.4f}"
        rows.append(
            [number, "eps_total", "", "", "", percent(total_response_error(answers)), total_printed]
        )
    return rows
