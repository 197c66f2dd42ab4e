"""Section 5 of the report for the HTML page: verdicts, Tables 8 and 9, collinearity, global indices."""

import math

from epv_env.plant.parameters import confidence_intervals, sensitive_symbols, table
from identification.report.page import Block, Picture, Section, Table, Text, Verdict
from identification.sensitivity import sensitivity_figures as figures
from identification.sensitivity.collinearity import OutputSensitivities
from identification.sensitivity.global_indices import SobolIndices
from identification.sensitivity.printed_agreement import (
    PrintedAgreement,
    agreement_with_printed,
    percentages,
    printed_rows,
)
from identification.sensitivity.report_conditions import REPORT_CONDITIONS
from identification.sensitivity.sensitivity_study import (
    FIXED_STEP_CONDITIONS,
    OneAtATime,
    SensitivityStudy,
)
from identification.sensitivity.settings import SENSITIVITY

METHOD = (
    "The report's rows of the armature most likely carry the scatter of its own simulation: with a "
    "fixed step of 0.5 ms the plant's equations show it too, with exactly located stops they do not. a1 "
    "is zero, so 10 % of it is no change: its row shows the ends of its domain, ±0.1 rad."
)
"""How the tables were computed, for the page."""


def sensitivity_section(study: SensitivityStudy, *, report_2003: bool = False) -> Section:
    """Everything that section 5 shows; report_2003: beside the report's values."""
    rows = study.one_at_a_time
    return Section(
        title="Parametric sensitivity",
        printed="section 5",
        verdicts=[
            *(_reproductions(rows) if report_2003 else []),
            *_separability(study.outputs),
            _dominant(study.indices),
        ],
        blocks=[
            *(_beside_printed(rows) if report_2003 else [_errors(rows)]),
            _pairs(study.outputs),
            Picture(
                figure=figures.collinearity_map(study.outputs),
                caption=f"Collinearity of pairs of parameters in p2, p3 and I of {study.outputs.where}, "
                "weighted by the sensors' noise (Brun et al. 2001).",
            ),
            Picture(
                figure=figures.global_bars(study.indices, study.screening),
                caption="Global sensitivity of the total error, all parameters within ±5 % at once "
                "(a1 within ±0.05 rad), with bootstrap 95 % intervals.",
            ),
        ],
    )


def _reproductions(rows: OneAtATime) -> list[Verdict]:
    return [
        _reproduced("Fixed step", agreement_with_printed(rows.fixed_step)),
        _reproduced("Exact stops", agreement_with_printed(rows.exact)),
    ]


def _beside_printed(rows: OneAtATime) -> list[Block]:
    """Tables 8 and 9 beside ours, as text, table and figure."""
    picture = Picture(figure=figures.tornado(rows, printed_rows()), caption="Tables 8 and 9.")
    return [Text(text=METHOD), _rows(rows), picture]


def _errors(study: OneAtATime) -> Table:
    """How far the responses move with each parameter, the most sensitive first."""
    errors = {symbol: percentages(study.exact[symbol]) for symbol in printed_rows()}
    order = sorted(errors, key=lambda symbol: max(errors[symbol]), reverse=True)
    return Table(
        columns=["Parameter", "total error for −10 % / +10 % [%]"],
        rows=[[f"{table()[symbol].meaning} ({symbol})", _pair(errors[symbol])] for symbol in order],
        caption="How far the responses move when one parameter changes. a1 is zero and goes to the ends "
        "of its domain, ±0.1 rad.",
    )


def _reproduced(method: str, met: PrintedAgreement) -> Verdict:
    classes = (
        f"classes differ for {', '.join(met.classes_differ)}"
        if met.classes_differ
        else "all classes agree"
    )
    good = met.reproduced >= SENSITIVITY.required_figures and not met.classes_differ
    return Verdict(
        status="good" if good else "doubt",
        text=f"{method}: {met.reproduced} of {met.figures} figures of Tables 8 and 9 within 10 % or 0.1 "
        f"percentage points, {classes}, the farthest by a factor of {met.worst_factor:.2g}.",
    )


def _separability(outputs: OutputSensitivities) -> list[Verdict]:
    four, sensitive = outputs.index(tuple(confidence_intervals())), outputs.index(sensitive_symbols())
    pairs, critical = outputs.inseparable_pairs(), outputs.settings.critical_index
    return [
        Verdict(
            status="good" if four < critical else "bad",
            text=f"The four calibrated parameters together have a collinearity index of {four:.1f}; "
            f"below {critical:g} data can tell them apart.",
        ),
        Verdict(
            status="good" if sensitive < critical else "note",
            text=f"All {len(sensitive_symbols())} sensitive ones together: {_index(sensitive)}. "
            f"{len(pairs)} pairs cannot be told apart, first "
            f"{' and '.join(f'{a}, {b}' for a, b, _ in pairs[:2])}, which act by their ratio alone.",
        ),
    ]


def _dominant(indices: SobolIndices) -> Verdict:
    order = sorted(zip(indices.total, indices.symbols, strict=True), reverse=True)
    names = ", ".join(f"{symbol} {value:.2f}" for value, symbol in order[:4])
    return Verdict(status="note", text=f"Greatest total Sobol indices of the total error: {names}.")


def _rows(study: OneAtATime) -> Table:
    return Table(
        columns=[
            "Parameter",
            "class",
            "the report [%]",
            "fixed step [%]",
            "scatter [%]",
            "exact stops [%]",
        ],
        rows=[_cells(study, symbol, printed) for symbol, printed in printed_rows().items()],
        caption=f"Total error for −10 % / +10 % (Tables 8 and 9) at p1 = "
        f"{REPORT_CONDITIONS.p1 / 1e5:g} bar, "
        f"p2(0) = {REPORT_CONDITIONS.p2 / 1e5:g} bar, U = {REPORT_CONDITIONS.U_on:g} V; with the "
        "fixed step "
        f"{FIXED_STEP_CONDITIONS.U_on:g} V, its scatter over 18.5 to 19.3 V.",
    )


def _cells(study: OneAtATime, symbol: str, printed: tuple[float, float]) -> list[str]:
    low, high = 100 * study.scatter[symbol].min(axis=0), 100 * study.scatter[symbol].max(axis=0)
    return [
        symbol,
        "Sensitive" if table()[symbol].sensitive else "Not sensitive",
        _pair(printed),
        _pair(percentages(study.fixed_step[symbol])),
        f"{low[0]:.3g}–{high[0]:.3g} / {low[1]:.3g}–{high[1]:.3g}",
        _pair(percentages(study.exact[symbol])),
    ]


def _pair(values: tuple[float, float]) -> str:
    return f"{values[0]:.3g} / {values[1]:.3g}"


def _pairs(outputs: OutputSensitivities) -> Table:
    return Table(
        columns=["Pair", "collinearity index"],
        rows=[[f"{a}, {b}", _index(index)] for a, b, index in outputs.inseparable_pairs()],
        caption=f"Pairs above {outputs.settings.critical_index:g}: a change of one can be made up for "
        "by the other.",
    )


def _index(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "infinite"
