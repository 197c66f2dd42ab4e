"""The valve's next experiment: feasible pulse programmes, simulated for every rival beforehand."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from epv_env.common.units import BAR
from identification.bench.programmes import Programme
from identification.gap.experiment_design import (
    InformationGain,
    Rivals,
    expected_information,
    odds_text,
    select_rivals,
)
from identification.gap.quantities import listed
from identification.gap.verdict import PARTIAL, UNKNOWN, Ranking
from identification.recordings.recording import CHANNELS, Recording
from identification.replay.model_inputs import ModelInputs
from identification.replay.replay import Replay
from identification.report_2003 import Case
from identification.valve_gap.valve import Valve, as_run

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
    (9.0, 4.5, 24.0),
    (9.0, 7.0, 20.0),
    (10.5, 5.5, 28.0),
    (11.0, 8.0, 24.0),
    (12.0, 6.5, 20.0),
    (12.5, 4.5, 24.0),
    (12.5, 8.0, 28.0),
)
"""Supply and circuit at the start [bar absolute], voltage of the energised coil [V]: the corners of what
the bench can be set to (9 to 12.5 bar, 4.5 to 8 bar, 20 to 28 V), and some between."""

CANDIDATES = tuple(
    Programme(
        name=f"next_{case.name.replace(' ', '_')}_{p1:g}_{p2:g}_{U_on:g}".replace(".", "p"),
        role="calibration",
        case=case,
        p1=p1 * BAR,
        p2=p2 * BAR,
        U_on=U_on,
    )
    for case in CASES
    for p1, p2, U_on in CONDITIONS
)
"""Every case under every condition."""

SEPARATING_SHARE = 0.5
"""An experiment separates rivals if it leaves at most this share of the doubt about the best [-]."""

CERTAIN = 0.95
"""Probability of the best rival above which no further experiment is needed [-]."""

FILE_NAME = "next.json"
RUN = f"epv bench --programme {FILE_NAME} --out next"
"""Where the programme is kept, and how the bench runs it."""


NOTHING_EXPLAINS = (
    "No cause of the catalogue explains the recordings, so none can say which programme would tell "
    "more: look at the shape of the missing term first"
)
REST_WITHOUT_NAME = (
    "{} needs no further experiment, and what remains beside it has no name that a programme could "
    "test: look at the shape of the missing term first"
)
"""Why no programme can be chosen."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """A programme and what it promises."""

    programme: Programme
    information: InformationGain


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """What to record next, and why."""

    text: str
    """One sentence for people."""
    options: tuple[Option, ...]
    """All candidates, the most telling first; empty where no programme can be chosen."""

    @property
    def programme(self) -> Programme | None:
        """The most telling programme; None where none can be chosen."""
        return self.options[0].programme if self.options else None


def next_experiment(
    ranking: Ranking, valve: Valve, verdict: str, programmes: Sequence[Programme] = CANDIDATES
) -> NextExperiment:
    """The programme after which the least doubt between the most probable hypotheses is expected.

    Args:
        ranking: the hypotheses and their probabilities.
        valve: the campaign that was diagnosed.
        verdict: of the diagnosis. No programme can separate hypotheses that are not there: where the
            cause is unknown, or known but for a remainder without a name, the shape of the missing term
            comes first.
        programmes: candidates.
    """
    rivals = select_rivals(ranking)
    if verdict == UNKNOWN:
        return NextExperiment(text=NOTHING_EXPLAINS, options=())
    if verdict == PARTIAL and rivals.probability[0] > CERTAIN:
        return NextExperiment(text=REST_WITHOUT_NAME.format(rivals.titles[0]), options=())
    found = expected_information(ranking.problem, planned(valve, programmes), rivals)
    options = [Option(programme=p, information=i) for p, i in zip(programmes, found, strict=True)]
    options.sort(key=lambda option: option.information.sort_key)
    return NextExperiment(text=sentence(options[0], rivals), options=tuple(options))


def planned(valve: Valve, programmes: Sequence[Programme]) -> Valve:
    """The valve with programmes that have not been run as its recordings, at the campaign's rate.

    Outputs are zero, as nothing is measured; the supply is constant, as every rival will be given the
    recorded one.
    """
    plan = copy(valve)
    period = valve.recordings[0].period
    plan.recordings = tuple(_expected(programme, period) for programme in programmes)
    plan.runs = tuple(as_run(recording) for recording in plan.recordings)
    plan.replay = Replay(
        [_drive(p, r) for p, r in zip(programmes, plan.recordings, strict=True)], valve.base
    )
    return plan


def sentence(option: Option, rivals: Rivals) -> str:
    """What to record, and the expected odds."""
    names = listed(rivals.titles)
    before = ":".join(f"{100 * p:.0f}" for p in rivals.probability)
    after = odds_text(option.information.expected_best)
    record = described(option.programme)
    if rivals.probability[0] > CERTAIN:
        return (
            f"None is needed ({rivals.titles[0]}: {odds_text(rivals.probability[0])}); {record} would "
            f"tell {names} apart best ({RUN})"
        )
    doubt = 1.0 - rivals.probability[0]
    if 1.0 - option.information.expected_best <= SEPARATING_SHARE * doubt:
        return f"Record {record}: expected to bring {before} between {names} to {after} ({RUN})"
    return (
        f"No feasible programme splits {names}: even the best, {record}, is expected to bring "
        f"{before} to {after} only ({RUN})"
    )


def described(programme: Programme) -> str:
    """A programme in words."""
    case = programme.case
    lengths = [round(1e3 * opening) for opening in case.openings]
    openings = f"{len(lengths)} openings of {listed([str(x) for x in lengths])} ms"
    if len(lengths) == 1:
        openings = f"one opening of {lengths[0]} ms"
    pauses = f" {1e3 * case.pause:.0f} ms apart" if len(lengths) > 1 else ""
    return (
        f"{openings}{pauses} from {programme.p1 / BAR:g} bar supply into {programme.p2 / BAR:g} bar at "
        f"{programme.U_on:g} V, {case.duration:g} s in all"
    )


def _expected(programme: Programme, period: float) -> Recording:
    """The recording of a programme as far as it is known before."""
    U = programme.case.voltage(programme.U_on, 1.0 / period)
    zero = np.zeros_like(U)
    imposed = {"U": U, "p1": zero + programme.p1, "p2": zero + programme.p2}
    signals = {name: imposed.get(name, zero) for name in CHANNELS}
    return Recording(name=programme.name, role=programme.role, period=period, sigma_S=zero, **signals)


def _drive(programme: Programme, recording: Recording) -> ModelInputs:
    """What the programme imposes on the model."""
    return ModelInputs(
        period=recording.period, U=recording.U, p1=recording.p1, sigma_S=recording.sigma_S,
        U_start=programme.U_on, p2_start=programme.p2,
    )  # fmt: skip
