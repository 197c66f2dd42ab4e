"""What the printed tables say of the causes, for the HTML page."""

import numpy as np

from identification.recordings.recording import OUTPUTS
from identification.report.page import Picture, Section, Table, Text, Verdict
from identification.studies.error_tables import error_table_figures as figures
from identification.studies.error_tables.bench_conditions import CASES, N_FITTED
from identification.studies.error_tables.candidates import NONE
from identification.studies.error_tables.patterns import printed_after
from identification.studies.error_tables.ranking import (
    CANNOT,
    CURRENT,
    GIVES,
    PRESSURES,
    TOLERANCE,
    Match,
    inseparable,
)
from identification.studies.error_tables.results import Study

METHOD = (
    "Each cause is put into the plant at many sizes within its physical range, the nominal model's "
    "four parameters are recalibrated on tests 1 to 4 by the total error (eq. 21), and the errors of "
    "all five tests with the sensors' noise are compared with Tables 13 and 15. A typical factor of 1.2 "
    "says that predicted errors are off by 20 % on average (root mean square of logarithms). Test "
    "conditions that the report does not print are drawn; intervals hold 80 % of the draws. Ranges of "
    "sizes: docs/effects.md."
)
INFERENCE = (
    "All of this is inference from 27 printed figures: the recordings were never published. A cause "
    "outside the catalogue, or three at once, can give the same figures."
)


def sections(study: Study) -> list[Section]:
    """The current's residual, each cause alone, and two causes at once."""
    return [_current(study), _alone(study), _together(study)]


def _current(study: Study) -> Section:
    found, share = study.residual, np.median(study.winding.share, axis=0)
    warmth = np.median(study.winding.warmth, axis=0)
    printed = printed_after()[:, OUTPUTS.index("I")]
    return Section(
        title="What the current's errors mean",
        verdicts=[
            Verdict(
                status="note",
                text=f"The model misses the current by {1e3 * found.rms.min():.0f} to "
                f"{1e3 * found.rms.max():.0f} mA rms; noise gives 0.8 mA. Shared among the switchings "
                f"that is as if the whole current came {1e3 * found.step_time.min():.2f} to "
                f"{1e3 * found.step_time.max():.2f} ms late or early at each.",
            ),
            Verdict(
                status="note",
                text="A warmer or colder winding from test to test makes up "
                + ", ".join(f"{100 * value:.0f}" for value in share)
                + " % of the squared error of tests 1 to 4 (Table 11 against Table 13): it is there, "
                "and it is not the main thing.",
            ),
        ],
        blocks=[
            Table(
                columns=["Test", *(case.name for case in CASES)],
                rows=[
                    ["printed error of I [%]", *_numbers(printed, "{:.2f}")],
                    ["mean current [mA]", *_numbers(1e3 * found.mean, "{:.0f}")],
                    ["rms residual [mA]", *_numbers(1e3 * found.rms, "{:.1f}")],
                    ["switchings", *_numbers(found.edges, "{:d}")],
                    ["its square per switching [mA² s]", *_numbers(1e6 * found.per_edge, "{:.0f}")],
                    ["the same as time of a full step [ms]", *_numbers(1e3 * found.step_time, "{:.2f}")],
                    ["or as error of the holding current [%]", *_numbers(100 * found.plateau, "{:.1f}")],
                    ["winding against the tests' mean [K]", *_numbers(warmth, "{:+.1f}"), "–"],
                ],
                caption="At the conditions that fit Tables 8 and 9. One R cannot leave 5.5 % of the "
                "holding current with one sign in tests 1 to 3, and the windings differ by a few kelvin "
                "only: most of the residual lies in the switchings.",
            )
        ],
    )  # fmt: skip


def _alone(study: Study) -> Section:
    by_verdict = {v: [m for m in study.singles if m.verdict == v] for v in (GIVES, CURRENT, PRESSURES)}
    nearest = study.singles[0]
    return Section(
        title="Each cause alone",
        verdicts=[
            Verdict(
                status="good" if by_verdict[GIVES] else "doubt",
                text=f"{len(by_verdict[GIVES])} causes give the whole pattern alone; the nearest is "
                f"{', '.join(inseparable(study.singles))} (typical factor {nearest.median:.2f}, "
                f"{nearest.candidate.size}: predicted over printed {nearest.reason}).",
            ),
            *(_part(verdict, by_verdict[verdict]) for verdict in (CURRENT, PRESSURES)),
            Verdict(status="note", text=_none(study)),
        ],
        blocks=[
            Text(text=METHOD),
            Picture(figure=figures.ranking(study), caption="Causes alone and in pairs."),
            _ranking(study.singles),
        ],
    )


def _part(verdict: str, found: list[Match]) -> Verdict:
    what, key = ("the current", "current") if verdict == CURRENT else ("the pressures", "pressures")
    order = sorted(found, key=lambda match: getattr(match, key))
    names = ", ".join(
        f"{m.cause} ({m.candidate.size}; factor {getattr(m, key):.2f}"
        f"{', under some conditions only' if getattr(m, key) > TOLERANCE else ''})"
        for m in order
    )
    return Verdict(status="note", text=f"Errors of {what} alone: {names or 'no cause'}.")


def _none(study: Study) -> str:
    (none,) = [match for match in study.singles if match.cause == NONE]
    least = ", ".join(
        f"{output} {value:.2f} %"
        for output, value in zip(OUTPUTS, none.predicted[:N_FITTED].mean(axis=0), strict=True)
    )
    return f"Without any cause the noise would leave {least}: the gap is real in all three outputs."


def _ranking(found: list[Match]) -> Table:
    return Table(
        columns=[
            "Cause", "size", "typical factor", "80 % of conditions", "current alone", "pressures alone",
            "predicted / printed", "verdict",
        ],
        rows=[
            [
                m.cause, m.candidate.size, f"{m.median:.2f}", "{:.2f}–{:.2f}".format(*m.interval),
                f"{m.current:.2f}", f"{m.pressures:.2f}", m.reason, m.verdict,
            ]
            for m in found
        ],
        caption="Typical factors between predicted and printed errors. 'Current alone' and 'pressures "
        "alone': of the worst output, if the other errors may be too small; "
        f"'{CANNOT}': none below {TOLERANCE:g} in a tenth of the conditions.",
    )  # fmt: skip


def _together(study: Study) -> Section:
    trust = study.trust
    order = sorted(study.probability.items(), key=lambda item: -item[1])
    likely = ", ".join(f"{cause} {share:.2f}" for cause, share in order if share >= 0.02)
    group = inseparable(study.checked)
    return Section(
        title="Two causes at once",
        verdicts=[
            Verdict(
                status="good" if study.checked[0].verdict == GIVES else "doubt",
                text=f"Nearest pair: {study.checked[0].cause} (typical factor "
                f"{study.checked[0].median:.2f}). Cannot be separated from it: "
                f"{'; '.join(group[1:]) or 'none'}.",
            ),
            Verdict(status="note", text=f"Probability of each cause to be one of two: {likely}."),
            Verdict(
                status="note",
                text=f"How sure: of {trust.n} made-up tables of two known causes, as scattered as the "
                f"printed one, the true cause of the current's errors was among the two most probable "
                f"in {100 * trust.first:.0f} % and within the 90 % set in {100 * trust.within:.0f} %; "
                f"that of the pressures' errors within it in {100 * trust.second:.0f} %.",
            ),
        ],
        blocks=[Text(text=INFERENCE), _pairs(study)],
    )


def _pairs(study: Study) -> Table:
    return Table(
        columns=[
            "Pair", "size", "typical factor", "80 % of conditions", "Table 11", "predicted / printed",
        ],
        rows=[
            [
                m.cause, m.candidate.size, f"{m.median:.2f}", "{:.2f}–{:.2f}".format(*m.interval),
                f"{m.before:.2f}", m.reason,
            ]
            for m in study.checked
        ],
        caption="The pairs nearest by adding squares of errors, as simulated together. Table 11 was not "
        "used to choose them: its typical factor is a check.",
    )  # fmt: skip


def _numbers(values: np.ndarray, form: str) -> list[str]:
    return [form.format(value) for value in values]
