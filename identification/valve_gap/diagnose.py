"""From a campaign's folder to gap.json, report and a plant file with the cause."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from os import PathLike
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from epv_env.common.command_line import NextStep, beside
from epv_env.common.files import Journal
from epv_env.plant.effects.law import knot_symbols
from epv_env.plant.plantfile import Plant, load_plant, plant_subject, save_plant
from epv_env.plant.region import Alternative, Mixture, Region
from identification.bench.programmes import at_voltage, save_programmes
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.fitting_problem import Estimate, FitCache, FittingProblem
from identification.gap.fit.laws import COMPONENTS
from identification.gap.judge.held_out import NOMINAL, RECALIBRATED
from identification.gap.judge.verdict import AMBIGUOUS, UNKNOWN
from identification.gap.report.gap_json import fitted_values, parameter_covariance, write_results
from identification.gap.report.page import sections
from identification.recordings.campaign_files import read_campaign
from identification.recordings.recording import campaign_facts, rules_of
from identification.report.page import Section, write_page
from identification.valve_gap.next_recording import CANDIDATES, NextRecording, next_recording
from identification.valve_gap.next_recording import FILE_NAME as PROGRAMME
from identification.valve_gap.valve import Valve

REPORT, PLANT, JOURNAL = "report.html", "plant.json", "fits.jsonl"

More = Callable[[Diagnosis, Plant], Sequence[Section]]
"""Makes further sections of the report from the diagnosis and the corrected plant."""

REGION_PROBABILITY = 0.95
"""Probability that the plant file's region holds the parameters, and its alternatives the truth [-]."""


def diagnose_campaign(
    campaign: Path,
    out: Path,
    *,
    plant: str | PathLike[str] | None = None,
    without: Sequence[str] = (),
    seed: int = 0,
    report: bool = True,
    noise: Mapping[str, float] | None = None,
) -> Diagnosis:
    """Diagnose a campaign; write gap.json, and unless `report` is False report, plan and plant file.

    plant: plant file of the nominal parameters, None for Table 10. without: causes to leave out of the
    catalogue. noise: standard deviation of the readings by channel [Pa, A], where it is not to be
    estimated. Finished fits are kept in `out` and taken up again. Raises CampaignError for recordings
    that cannot be used, ValueError for an unknown cause, a wrong noise or a plant file that is none.
    """
    began = perf_counter()
    described = load_plant(plant) if plant else None
    recorded = read_campaign(campaign, rules_of(load_plant(plant)))
    valve = Valve(recorded, described, without=without, noise=noise)
    journal = Journal(out / JOURNAL, subject(valve, without, noise or {}))
    steps = steps_on_stderr(began) if report else lambda step: None
    found = diagnose(valve, seed=seed, cache=FitCache(valve, journal, steps))
    found = replace(found, warnings=[*valve.warnings, *found.warnings])
    step = next_step(found.conclusion.verdict, campaign, out, Path(plant) if plant else None)
    following = NextRecording(text="")
    if report:
        steps("next recording")
        following = _plan(found, valve, out)
        steps("report")
        write_report(found, valve, out, recorded.name, campaign_facts(recorded), step, following)
    write_results(found, out, following.text, seconds=perf_counter() - began)
    return found


def next_step(verdict: str, campaign: Path, out: Path, plant: Path | None) -> NextStep:
    """What to run after a diagnosis that wrote into `out`; plant: that it began with."""
    if verdict == AMBIGUOUS:
        words = ("bench", "--programme", out / PROGRAMME, "--out", beside(out, "next"))
        return NextStep("to record what tells these causes apart", words, plant)
    if verdict == UNKNOWN:
        purpose = "once the missing effect is in the catalogue (docs/extending.md)"
        return NextStep(purpose, ("gap", campaign, "--out", out), plant)
    words = ("train", "--parameters", "diagnosis", "--out", beside(out, "policy"))
    return NextStep("to train a policy for this plant", words, out / PLANT)


def _plan(found: Diagnosis, valve: Valve, out: Path) -> NextRecording:
    """Find what to record next, and write its programme."""
    programmes = at_voltage(CANDIDATES, valve.plant.voltage)
    following = next_recording(found.ranking, valve, found.conclusion.verdict, programmes)
    (out / PROGRAMME).unlink(missing_ok=True)
    if following.programme:
        save_programmes([following.programme], out / PROGRAMME, valve.plant.sensors)
    return following


def write_report(
    found: Diagnosis,
    valve: Valve,
    out: Path,
    name: str,
    facts: Mapping[str, str],
    step: NextStep,
    following: NextRecording | None = None,
    more: More | None = None,
) -> None:
    """Write the report and the plant file. name: of the recordings; facts: what the page rests on."""
    following = following or NextRecording(text="")
    corrected = refitted_plant(found, valve, name)
    save_plant(corrected, out / PLANT)
    write_page(
        out / REPORT,
        title=f"Gap between model and recordings: {name}",
        sections=sections(
            found,
            following.text,
            [following.table] if following.table else [],
            more(found, corrected) if more else (),
        ),
        facts=facts,
        next_step=step,
    )


def refitted_plant(found: Diagnosis, valve: Valve, name: str) -> Plant:
    """The plant refitted together with the cause to add, laws included, else recalibrated or nominal.

    To be added is what the verdict names, whether it explains all or a part, and what surely reduces the
    gap on held-out recordings. Its region is where the recordings leave parameters, sizes and laws,
    jointly; autocorrelated residuals widen it. Its `diagnosis` holds every plant that is still possible.
    """
    best = found.model
    region = region_of(found, best, valve)
    methods = {RECALIBRATED: "recalibration", NOMINAL: "none: recalibration makes it worse"}
    own = f" with {best.label}" if best.labels else f", {found.model_label}"
    return valve.plant.refitted(
        region,
        name + own,
        diagnosis=possible_plants(found, valve),
        method=methods.get(found.model_label, "joint refit with the cause of the gap"),
        verdict=found.conclusion.verdict,
        recordings_sha256={r.name: r.sha256 for r in valve.recordings},
        warnings=found.warnings,
    )


def possible_plants(found: Diagnosis, valve: Valve) -> Mixture:
    """The likeliest plants that hold nearly all of the probability, each with its region.

    No cause and an unknown one are both the recalibrated plant.
    """
    ranking = found.ranking
    unnamed = (ranking.no_cause + ranking.unknown, ranking.recalibrated)
    pairs = [*zip(ranking.probabilities, ranking.hypotheses, strict=True), unnamed]
    pairs.sort(key=lambda pair: -pair[0])
    before = np.cumsum([0.0, *(probability for probability, _ in pairs)])
    kept = [pair for pair, held in zip(pairs, before, strict=False) if held < REGION_PROBABILITY]
    whole = sum(probability for probability, _ in kept)
    return Mixture(
        alternatives=tuple(
            Alternative(
                name=hypothesis.label or RECALIBRATED,
                probability=float(probability / whole),
                region=region_of(found, hypothesis, valve),
            )
            for probability, hypothesis in kept
        )
    )


def region_of(found: Diagnosis, hypothesis: EvaluatedHypothesis, valve: Valve) -> Region:
    """Where the recordings leave calibrated parameters, laws and sizes of a hypothesis, jointly."""
    problem, estimate = found.ranking.problem, hypothesis.estimate
    fitted = fitted_values(found, hypothesis) | problem.law_values(estimate)
    inside = {s: float(np.clip(value, *valve.base.domain(s))) for s, value in fitted.items()}
    symbols, jacobian = _plant_symbols(problem, estimate)
    return Region(
        centre=valve.base.replace(**inside),
        symbols=symbols,
        covariance=jacobian @ parameter_covariance(found, hypothesis) @ jacobian.T,
        chi_square=float(chi2.ppf(REGION_PROBABILITY, jacobian.shape[1])),
    )


def _plant_symbols(problem: FittingProblem, estimate: Estimate) -> tuple[tuple[str, ...], NDArray]:
    """Symbols of the plant that were fitted, and their derivatives by the fitted numbers [SI].

    A law has several components, of which its knots follow.
    """
    names = [p.symbol for p in problem.parameters(estimate)]
    symbols, rows = [], []
    knots = {}
    for number, (law, _) in enumerate(estimate.acting_laws, start=1):
        first = names.index(law.parameters[0].symbol)
        knots[first] = dict(zip(knot_symbols(number), COMPONENTS, strict=True))
    opened = {p.symbol for law in estimate.hypothesis.laws for p in law.parameters}
    for place, name in enumerate(names):
        for symbol, weights in knots.get(place, {}).items():
            symbols.append(symbol)
            rows.append(np.zeros(len(names)))
            rows[-1][place : place + len(weights)] = weights
        if name not in opened:
            symbols.append(name)
            rows.append(np.eye(len(names))[place])
    return tuple(symbols), np.array(rows).reshape(len(symbols), len(names))


def steps_on_stderr(began: float) -> Callable[[str], None]:
    """Says on stderr which step has begun; began: start of the diagnosis, of `perf_counter` [s]."""
    numbers = count(1)
    return lambda step: print(
        f"[{next(numbers)}] {step} ({perf_counter() - began:.0f} s)", file=sys.stderr
    )


def subject(valve: Valve, without: Sequence[str], noise: Mapping[str, float]) -> dict:
    """What the fits depend on."""
    return {
        **plant_subject(valve.plant),
        "recordings": {r.name: [r.role, r.digest()] for r in valve.recordings},
        "nominal": dict(valve.base),
        "without": sorted(without),
        "noise": dict(noise),
    }
