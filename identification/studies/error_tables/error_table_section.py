"""What the printed tables say of the causes, for the HTML page."""

import numpy as np
from numpy.typing import NDArray

from identification.recordings.recording import OUTPUTS
from identification.report.page import Picture, Section, Table, Text, Verdict
from identification.studies.error_tables.bench_conditions import CASES, N_FITTED
from identification.studies.error_tables.candidates import NO_CAUSE
from identification.studies.error_tables.error_prediction import printed_calibrated_errors
from identification.studies.error_tables.error_table_figures import ranking_figure
from identification.studies.error_tables.ranking import (
    EXPLAINS_ALL,
    EXPLAINS_CURRENT,
    EXPLAINS_NOTHING,
    EXPLAINS_PRESSURES,
    CauseMatch,
    inseparable_causes,
)
from identification.studies.error_tables.results import ErrorTableResults

METHOD = (
    "Each cause is put into the plant at many sizes within its physical range. The nominal model's four "
    "parameters are recalibrated on tests 1 to 4 by the total error (eq. 21). The errors of all five "
    "tests with the sensors' noise are compared with Tables 13 and 15. A typical factor of 1.2 means "
    "that predicted errors are off by 20 % on average (root mean square of logarithms). Test conditions "
    "that the report does not print are drawn; intervals hold 80 % of the draws. Ranges of sizes: "
    "docs/explanation/effects.md."
)
INFERENCE = (
    "All of this is inference from 27 printed figures: the recordings were never published. A cause "
    "outside the catalogue, or three at once, can give the same figures."
)
LEAST_SHOWN_PROBABILITY = 0.02
"""Probability from which the text names a cause [-]."""


def sections(results: ErrorTableResults) -> list[Section]:
    """The current's residual, each cause alone, and two causes at once."""
    return [_current_section(results), _singles_section(results), _pairs_section(results)]


def _current_section(results: ErrorTableResults) -> Section:
    residual, share = results.residual, np.median(results.winding.share, axis=0)
    shares = ", ".join(f"{100 * value:.0f}" for value in share)
    return Section(
        title="What the current's errors mean",
        verdicts=[
            Verdict(
                status="note",
                text=f"The model misses the current by {1e3 * residual.rms.min():.0f} to "
                f"{1e3 * residual.rms.max():.0f} mA rms; noise gives 0.8 mA. Shared among the "
                "switchings that is as if the whole current came "
                f"{1e3 * residual.step_time.min():.2f} to "
                f"{1e3 * residual.step_time.max():.2f} ms late or early at each.",
            ),
            Verdict(
                status="note",
                text=f"A warmer or colder winding from test to test makes up {shares} % of the squared "
                "error of tests 1 to 4 (Table 11 against Table 13): it is there, and it is not the main "
                "thing.",
            ),
        ],
        blocks=[_current_table(results)],
    )


def _current_table(results: ErrorTableResults) -> Table:
    residual = results.residual
    printed = printed_calibrated_errors()[:, OUTPUTS.index("I")]
    temperature = np.median(results.winding.temperature, axis=0)
    return Table(
        columns=["Test", *(case.name for case in CASES)],
        rows=[
            ["printed error of I [%]", *_cells(printed, "{:.2f}")],
            ["mean current [mA]", *_cells(1e3 * residual.mean, "{:.0f}")],
            ["rms residual [mA]", *_cells(1e3 * residual.rms, "{:.1f}")],
            ["switchings", *_cells(residual.edges, "{:d}")],
            ["its square per switching [mA² s]", *_cells(1e6 * residual.per_edge, "{:.0f}")],
            ["the same as time of a full step [ms]", *_cells(1e3 * residual.step_time, "{:.2f}")],
            ["or as error of the holding current [%]", *_cells(100 * residual.plateau, "{:.1f}")],
            ["winding against the tests' mean [K]", *_cells(temperature, "{:+.1f}"), "–"],
        ],
        caption="At the conditions that fit Tables 8 and 9. One R cannot leave 5.5 % of the holding "
        "current with one sign in tests 1 to 3, and the windings differ by a few kelvin only: most of "
        "the residual lies in the switchings.",
    )


def _singles_section(results: ErrorTableResults) -> Section:
    by_verdict = {
        verdict: [match for match in results.singles if match.verdict == verdict]
        for verdict in (EXPLAINS_ALL, EXPLAINS_CURRENT, EXPLAINS_PRESSURES)
    }
    nearest = results.singles[0]
    group = ", ".join(inseparable_causes(results.singles, results.settings))
    tolerance = results.settings.tolerance
    return Section(
        title="Each cause alone",
        verdicts=[
            Verdict(
                status="good" if by_verdict[EXPLAINS_ALL] else "doubt",
                text=f"{len(by_verdict[EXPLAINS_ALL])} causes give the whole pattern alone; the nearest "
                f"is {group} (typical factor {nearest.median:.2f}, "
                f"{nearest.candidate.size}: predicted over printed {nearest.error_ratios}).",
            ),
            _part_verdict("current", by_verdict[EXPLAINS_CURRENT], tolerance),
            _part_verdict("pressure", by_verdict[EXPLAINS_PRESSURES], tolerance),
            Verdict(status="note", text=_noise_text(results)),
        ],
        blocks=[
            Text(text=METHOD),
            Picture(figure=ranking_figure(results), caption="Causes alone and in pairs."),
            _singles_table(results.singles, tolerance),
        ],
    )


def _part_verdict(part: str, matches: list[CauseMatch], tolerance: float) -> Verdict:
    """The causes that explain one part of the pattern. part: 'current' or 'pressure'."""
    factors = {match.cause: getattr(match, f"{part}_factor") for match in matches}
    names = ", ".join(
        f"{match.cause} ({match.candidate.size}; factor {factors[match.cause]:.2f}"
        f"{', under some conditions only' if factors[match.cause] > tolerance else ''})"
        for match in sorted(matches, key=lambda match: factors[match.cause])
    )
    outputs = {"current": "the current", "pressure": "the pressures"}[part]
    return Verdict(status="note", text=f"Errors of {outputs} alone: {names or 'no cause'}.")


def _noise_text(results: ErrorTableResults) -> str:
    (none,) = [match for match in results.singles if match.cause == NO_CAUSE]
    least = ", ".join(
        f"{output} {value:.2f} %"
        for output, value in zip(OUTPUTS, none.predicted[:N_FITTED].mean(axis=0), strict=True)
    )
    return f"Without any cause the noise would leave {least}: the gap is real in all three outputs."


def _singles_table(matches: list[CauseMatch], tolerance: float) -> Table:
    columns = [
        "Cause", "size", "typical factor", "80 % of conditions", "current alone", "pressures alone",
        "predicted / printed", "verdict",
    ]  # fmt: skip
    rows = [
        [
            *_match_cells(match),
            f"{match.current_factor:.2f}",
            f"{match.pressure_factor:.2f}",
            match.error_ratios,
            match.verdict,
        ]
        for match in matches
    ]
    caption = (
        "Typical factors between predicted and printed errors. 'Current alone' and 'pressures alone': "
        "of the worst output, if the other errors may be too small; "
        f"'{EXPLAINS_NOTHING}': none below {tolerance:g} in a tenth of the conditions."
    )
    return Table(columns=columns, rows=rows, caption=caption)


def _pairs_section(results: ErrorTableResults) -> Section:
    reliability, nearest = results.reliability, results.pairs[0]
    order = sorted(results.probability.items(), key=lambda item: -item[1])
    likely = ", ".join(
        f"{cause} {share:.2f}" for cause, share in order if share >= LEAST_SHOWN_PROBABILITY
    )
    group = inseparable_causes(results.pairs, results.settings)
    return Section(
        title="Two causes at once",
        verdicts=[
            Verdict(
                status="good" if nearest.verdict == EXPLAINS_ALL else "doubt",
                text=f"Nearest pair: {nearest.cause} (typical factor {nearest.median:.2f}). Cannot be "
                f"separated from it: {'; '.join(group[1:]) or 'none'}.",
            ),
            Verdict(status="note", text=f"Probability of each cause to be one of two: {likely}."),
            Verdict(
                status="note",
                text=f"How sure: of {reliability.tables} made-up tables of two known causes, as "
                "scattered as the printed one, the true cause of the current's errors was among the "
                f"two most probable in {100 * reliability.current_cause_first:.0f} % and within the "
                f"90 % set in {100 * reliability.current_cause_in_set:.0f} %; that of the pressures' "
                f"errors within it in {100 * reliability.pressure_cause_in_set:.0f} %.",
            ),
        ],
        blocks=[Text(text=INFERENCE), _pairs_table(results.pairs)],
    )


def _pairs_table(matches: list[CauseMatch]) -> Table:
    return Table(
        columns=[
            "Pair", "size", "typical factor", "80 % of conditions", "Table 11", "predicted / printed",
        ],
        rows=[
            [*_match_cells(match), f"{match.initial_factor:.2f}", match.error_ratios]
            for match in matches
        ],
        caption="The pairs nearest by adding squares of errors, as simulated together. Table 11 was not "
        "used to choose them: its typical factor is a check.",
    )  # fmt: skip


def _match_cells(match: CauseMatch) -> list[str]:
    """Cause, size, typical factor and its interval."""
    low, high = match.interval
    return [match.cause, match.candidate.size, f"{match.median:.2f}", f"{low:.2f}–{high:.2f}"]


def _cells(values: NDArray, form: str) -> list[str]:
    return [form.format(value) for value in values]
