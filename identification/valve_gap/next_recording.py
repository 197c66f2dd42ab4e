"""What to record next: the programme in which the two most probable answers differ most."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from epv_env.common.units import BAR
from identification.bench.programmes import Programme
from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.judge.verdict import KNOWN, NO_GAP, UNKNOWN, Ranking
from identification.gap.report.sentences import gap_text, listed, probability_text
from identification.recordings.recording import CHANNELS, Recording
from identification.replay.model_inputs import ModelInputs
from identification.replay.replay import Replay
from identification.replay.valve import as_run
from identification.report.page import Table
from identification.report_2003 import Case
from identification.valve_gap.valve import Valve

CASES = (
    Case(name="short pulses", openings=(0.02, 0.03, 0.04, 0.05, 0.06), duration=0.85, pause=0.1),
    Case(name="quick pulses", openings=(0.09,) * 4, duration=0.7, pause=0.05),
    Case(name="two openings", openings=(0.09, 0.12), duration=0.65),
    Case(name="four openings", openings=(0.06, 0.09, 0.12, 0.075), duration=1.3, pause=0.2),
    Case(name="long opening", openings=(0.4,), duration=0.9),
    Case(name="opening and rest", openings=(0.2, 0.05), duration=1.5, pause=0.9),
    Case(name="long hold", openings=(0.08,), duration=3.0),
)
"""From pulses too short to open the PV fully to a circuit that fills, with holds from 0.1 to 3 s."""

CONDITIONS = (
    (9.0, 4.5, 24.0), (9.0, 7.0, 20.0), (10.5, 5.5, 28.0), (11.0, 8.0, 24.0), (12.0, 6.5, 20.0),
    (12.5, 4.5, 24.0), (12.5, 8.0, 28.0),
)  # fmt: skip
"""Supply and circuit at the start [bar absolute], voltage of the energised coil [V]: the corners of what
the bench can be set to (9 to 12.5 bar, 4.5 to 8 bar, 20 to 28 V), and some between."""

CANDIDATES = tuple(
    Programme(
        name=f"next_{case.name.replace(' ', '_')}_{p1:g}_{p2:g}_{U_on:g}".replace(".", "p"),
        role="calibration", case=case, p1=p1 * BAR, p2=p2 * BAR, U_on=U_on,
    )
    for case in CASES
    for p1, p2, U_on in CONDITIONS
)  # fmt: skip
"""Every case under every condition."""

CERTAIN, APART = 0.95, 1.0
"""Probability of an answer above which no recording is needed [1]. Separation from which answers count
as told apart [noise deviations]: single readings then show it."""

FILE_NAME = "next.json"
RUN = f"epv bench --programme {FILE_NAME} --out next"
"""Where the programme is kept, and how the bench runs it."""

NOTHING_EXPLAINS = (
    "No cause of the catalogue explains the recordings: look at the shape of the missing term first."
)
MOST_ROWS, COLUMNS = 5, ("Programme", "Separation [noise deviations]")
"""Of the table."""


@dataclass(frozen=True, kw_only=True)
class NextRecording:
    """What to record next, and why; only `text` where nothing is to be told apart."""

    text: str
    """One sentence for people."""
    programme: Programme | None = None
    table: Table | None = None
    """The programmes that separate most, the best first."""


def next_recording(
    ranking: Ranking, valve: Valve, verdict: str, programmes: Sequence[Programme] = CANDIDATES
) -> NextRecording:
    """The programme, of these, that separates the two most probable answers most: causes, or no cause.

    None where the verdict is certain. valve: the campaign that was diagnosed. verdict: of the diagnosis;
    what is unknown predicts nothing.
    """
    if verdict == UNKNOWN or not ranking.hypotheses:
        return NextRecording(text=NOTHING_EXPLAINS)
    answers: dict[frozenset[str], tuple[float, Estimate]] = {}  # a set's laws are no other answer
    probabilities = (*ranking.probabilities, ranking.no_cause)
    for each, own in zip((*ranking.hypotheses, ranking.recalibrated), probabilities, strict=True):
        labels = frozenset(each.estimate.hypothesis.labels)
        before, estimate = answers.get(labels, (0.0, each.estimate))
        answers[labels] = before + own, estimate
    (probability, first), (_, second) = sorted(answers.values(), key=lambda answer: -answer[0])[:2]
    one, other = (
        " + ".join(cause.title for cause in answer.hypothesis.causes) or "no cause"
        for answer in (first, second)
    )
    if probability > CERTAIN and verdict in (KNOWN, NO_GAP):
        sure = f"{one}: {probability_text(probability)}"
        return NextRecording(text=f"No further recording is needed ({sure}).")
    separations = separation(ranking.problem, planned(valve, programmes), first, second)
    ranked = sorted(zip(programmes, separations, strict=True), key=lambda pair: -pair[1])[:MOST_ROWS]
    rows = [(described(programme), gap_text(apart)) for programme, apart in ranked]
    (record, by), (programme, apart) = rows[0], ranked[0]
    text = f"Record {record}: it separates {one} from {other} by {by} noise deviations ({RUN})."
    if apart < APART:
        text = (
            f"No programme of the bench tells {one} from {other}: even the best, {record}, separates "
            f"them by {by} noise deviations only ({RUN})."
        )
    return NextRecording(text=text, programme=programme, table=Table(columns=COLUMNS, rows=rows))


def separation(problem: FittingProblem, plan: Valve, first: Estimate, second: Estimate) -> list[float]:
    """Root mean square difference of two estimates in each run, 0 where one fails [noise deviations]."""
    values = problem.candidates([first, second])
    for p in (*first.hypothesis.run_parameters, *second.hypothesis.run_parameters):
        values[p.symbol] = np.full(2, p.centre)  # what was fitted is of other recordings
    noise = np.array([[channel.known_noise] for channel in problem.plant.channels])
    separations = []
    for run, output in zip(plan.runs, plan.outputs(values, range(len(plan.runs))), strict=True):
        difference = (output[..., 1] - output[..., 0]) / noise
        apart = np.sqrt(np.mean(difference[run.trusted] ** 2))
        separations.append(float(np.nan_to_num(apart, posinf=0.0)))
    return separations


def planned(valve: Valve, programmes: Sequence[Programme]) -> Valve:
    """The valve with programmes not yet run as its recordings: outputs are 0, the supply is constant."""
    plan, period = copy(valve), valve.recordings[0].period
    plan.recordings = tuple(_expected(programme, period) for programme in programmes)
    plan.runs = tuple(as_run(recording) for recording in plan.recordings)
    inputs = [
        ModelInputs(period=period, U=r.U, p1=r.p1, sigma_S=r.sigma_S, U_start=r.U[0], p2_start=r.p2[0])
        for r in plan.recordings
    ]
    plan.replay = Replay(inputs, valve.base)
    return plan


def _expected(programme: Programme, period: float) -> Recording:
    """The recording of a programme as far as it is known before; period: of sampling [s]."""
    U = programme.case.voltage(programme.U_on, 1.0 / period)
    zero = np.zeros_like(U)
    imposed = {"U": U, "p1": zero + programme.p1, "p2": zero + programme.p2}
    signals = {name: imposed.get(name, zero) for name in CHANNELS}
    return Recording(name=programme.name, role=programme.role, period=period, sigma_S=zero, **signals)


def described(programme: Programme) -> str:
    """A programme in words."""
    case = programme.case
    lengths = [f"{1e3 * opening:.0f}" for opening in case.openings]
    several = f"{len(lengths)} openings of {listed(lengths)} ms {1e3 * case.pause:.0f} ms apart"
    openings = several if len(lengths) > 1 else f"one opening of {lengths[0]} ms"
    conditions = f"{programme.p1 / BAR:g} bar supply into {programme.p2 / BAR:g} bar"
    return f"{openings} from {conditions} at {programme.U_on:g} V, {case.duration:g} s in all"
