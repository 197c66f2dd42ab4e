"""The calibration in the report: Tables 10 to 13 and the worst of Figures 10 to 13."""

from typing import Any

from epv_env.plant.parameters import table
from identification.calibration.calibrate import Calibration
from identification.calibration.search import METHODS, reached_best
from identification.replay.replay import total_response_error
from identification.replay.response_blocks import error_table, errors_as_json, percent, worst_picture
from identification.report.page import Section, Table, Verdict
from identification.report_2003 import ACCEPTED_ERROR


def calibration_section(calibration: Calibration) -> Section:
    """Estimates of both methods, errors before and after, and what speaks against them."""
    return Section(
        title="Calibration",
        verdicts=[
            _verdict(calibration),
            *(Verdict(status="doubt", text=warning) for warning in calibration.warnings),
        ],
        blocks=[
            _estimates(calibration),
            _offsets(calibration),
            _starts(calibration),
            error_table(calibration.before, "Errors at the start's parameters."),
            *(error_table(calibration.after[method], f"Errors after {method}.") for method in METHODS),
            worst_picture(calibration.after["least squares"]),
        ],
    )


def calibration_json(calibration: Calibration) -> dict[str, Any]:
    """Estimates in SI units, errors in percent, every search, and the warnings."""
    return {
        "estimates": {
            method: {s: calibration.parameters(method)[s] for s in calibration.problem.vector.symbols}
            for method in METHODS
        },
        "start": {
            s: calibration.problem.vector.reference[s] for s in calibration.problem.vector.symbols
        },
        "errors_before": errors_as_json(calibration.before),
        "errors_after": {m: errors_as_json(calibration.after[m]) for m in METHODS},
        "offsets_subtracted": {name: o.value for name, o in calibration.problem.offsets.items()},
        "noise": dict(calibration.problem.noise),
        "searches": {m: [fit.as_json() for fit in calibration.fits[m]] for m in METHODS},
        "warnings": calibration.warnings,
    }


def _verdict(calibration: Calibration) -> Verdict:
    error = total_response_error(calibration.after["Nelder-Mead"])
    before = total_response_error(calibration.before)
    rms = calibration.best("least squares").error
    good = error < ACCEPTED_ERROR
    return Verdict(
        status="good" if good else "bad",
        text=f"The total error falls from {percent(before)} to {percent(error)} %, "
        f"{'below' if good else 'not below'} the limit of {100 * ACCEPTED_ERROR:.0f} %; the "
        f"residual of the least-squares fit is {rms:.3g} times the noise (1 is the floor).",
    )


def _estimates(calibration: Calibration) -> Table:
    vector = calibration.problem.vector
    rows = []
    for symbol, (low, high) in zip(vector.symbols, vector.domains.tolist(), strict=True):
        row = table()[symbol]
        values = (vector.reference, *(calibration.parameters(method) for method in METHODS))
        name = f"{symbol} ({row.meaning}) [{row.unit}]"
        rows.append([name, *(f"{p[symbol]:.7g}" for p in values), f"{low:g} to {high:g}"])
    columns = ["Parameter", "start", *METHODS, "domain"]
    return Table(columns=columns, rows=rows, caption="Estimates.")


def _offsets(calibration: Calibration) -> str:
    offsets = calibration.problem.offsets
    if not offsets:
        return (
            "No record at rest shows the sensors' offsets: readings were taken as they are, so an error "
            "of the supply's, the circuit's or the voltage's sensor goes into the estimates."
        )
    listed = ", ".join(f"{name} {offset.value:.4g}" for name, offset in offsets.items())
    return f"Offsets at rest that were subtracted from the readings [A, V, Pa]: {listed}."


def _starts(calibration: Calibration) -> Table:
    scale = calibration.problem.vector.scale
    rows = [
        [
            method,
            ", ".join(f"{value:.4g}" for value in fit.start * scale),
            f"{fit.error:.5g}",
            "yes" if reached else "no",
            str(fit.evaluations),
            f"{fit.seconds:.2f}",
        ]
        for method, fits in calibration.fits.items()
        for fit, reached in zip(fits, reached_best(fits), strict=True)
    ]
    columns = ["Method", "start", "error at the end", "reaches the best", "evaluations", "time [s]"]
    caption = (
        f"Searches from several starts ({', '.join(calibration.problem.vector.symbols)}); error: the "
        "total error as a fraction for Nelder-Mead, rms in noise deviations for least squares."
    )
    return Table(columns=columns, rows=rows, caption=caption)
