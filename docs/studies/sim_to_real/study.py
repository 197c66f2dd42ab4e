"""The loop of `epv sim-to-real` on nine valves of another bench, and two rivals of the diagnosis.

    python -m docs.studies.sim_to_real.study --seeds 3

writes results.csv, sim-to-real.png and the generated parts of README.md. Finished steps are kept in
runs/sim_to_real/CODE and not repeated.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from controllers.base import Controller
from docs.studies.blind.bench import NO_OFFSETS, SUITE, run_programme
from docs.studies.blind.truth import draw_unit
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import write_text
from epv_env.common.options import COUNT
from epv_env.episode import WORN
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from epv_env.plant.region import Alternative, Mixture, Region
from epv_env.task import LimitingTask
from identification.bench.session import measured_campaign
from identification.gap.report.gap_json import GAP
from identification.recordings.campaign_files import FILE_NAME, write_campaign
from identification.valve_gap.diagnose import diagnose_campaign
from training.commands.sim_to_real import (
    AFTER,
    BEFORE,
    CAMPAIGN,
    DIAGNOSIS,
    MEASURED,
    WITHHELD,
    Options,
    deployed,
    diagnosis_text,
    loop,
    share_picture,
)
from training.evaluation.metrics import EpisodeMetrics, violation_interval
from training.evaluation.plots import COLOURS, save_figure
from training.evaluation.statistics import paired_difference

FOLDER = Path(__file__).parent


@dataclass(frozen=True, kw_only=True)
class Case:
    """A bench's valve: effects that training and diagnosis are not told."""

    name: str
    sizes: dict[str, float]
    """By symbol [SI]."""
    unevenness: float = 0.0
    """By how much the lag of p2 differs between rise and fall [1]; the catalogue knows an even one."""
    without: tuple[str, ...] = ()
    """Effects struck from the diagnosis's catalogue."""


FRICTION = {"F_PV": 15.0, "S_PV": 0.5}
CASES = (
    Case(name="piston friction", sizes=FRICTION),
    Case(name="sensor lag", sizes={"tau_p2": 0.015}),
    Case(name="sensor bias", sizes={"b_p2": 2e4}),
    Case(name="seat leak", sizes={"A_PV": 1e-7}),
    Case(name="lag + friction", sizes={"tau_p2": 0.01, "F_PV": 8.0}),
    Case(name="bias + command delay", sizes={"b_p2": 1.5e4, "t_delay": 0.005}),
    Case(name="lag + chamber heat", sizes={"tau_p2": 0.012, "tau_2": 0.5}),
    Case(name="lag, uneven (other law)", sizes={"tau_p2": 0.015}, unevenness=0.5),
    Case(name="friction, without its name", sizes=FRICTION, without=("piston_friction",)),
)
"""Of the catalogue's effects only friction, lag and bias of p2, and the seat's leak make a policy of the
nominal plant leave the band at sizes within the catalogue's ranges; every case holds one of them."""

EVERYTHING, TRUTH = "whole catalogue", "truth"
"""Stages beside those of the loop."""
ARMS = {BEFORE: "nominal plant", AFTER: "diagnosis", EVERYTHING: EVERYTHING, TRUTH: TRUTH}
"""What the policy of each stage was trained on."""
MARKS = {
    "nominal plant": ("o", "white", 7), "diagnosis": ("o", COLOURS[0], 7),
    EVERYTHING: ("s", "0.6", 7), TRUTH: ("|", "black", 16),
}  # fmt: skip
"""In the picture; larger where others may cover it."""

RANDOM_PLANTS = 4096
"""Plants of the whole catalogue that a training draws from."""
SEED = 7
"""Of valves and sensors."""
QUICK: dict[str, Any] = {"timesteps": 8192, "episodes": 8, "duration": 1.0}


@dataclass
class UnevenLag:
    """A policy on valves whose reading of p2 lags unevenly: 1/tau (1 - d D/(|D| + 50 mbar)).

    D is the reading less the pressure, d the unevenness, as in docs/studies/blind/forms.py. The lag is
    set at the begin of each control period, since the environment's own is even.
    """

    policy: Controller
    unevenness: float
    name: str = "uneven lag"
    environment: str = "EPValve-v0"
    task: LimitingTask = field(init=False)

    def reset(self, n: int) -> None:
        """n episodes begin."""
        self.policy.reset(n)

    def watch(self, task: LimitingTask) -> None:
        """The valves whose lag is set."""
        self.task = task
        self.values = dict(zip(Parameters.calibrated(), task.parameter_values.T, strict=True))

    def act(self, observations: NDArray) -> NDArray:
        """The policy's actions; sets the lag of the period that begins."""
        valves = self.task.valves
        ahead = valves.state.lag_2
        tau = self.values["tau_p2"] / (1.0 - self.unevenness * ahead / (np.abs(ahead) + 5e3))
        valves.set_parameters(np.arange(self.task.n), {**self.values, "tau_p2": tau}, self.task.volumes)
        return self.policy.act(observations)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--seeds", type=COUNT, default=1, help="trainings of each kind")
    parser.add_argument("--timesteps", type=COUNT, default=1_200_000, help="steps of each training")
    parser.add_argument("--episodes", type=COUNT, default=256, help="episodes of each deployment")
    parser.set_defaults(duration=6.0)
    options = study_options(parser, arguments)
    if options.quick:
        vars(options).update(QUICK)
    cases = CASES[:1] if options.quick else CASES
    found = [
        {"case": case.name, "arm": arm, "episodes": episodes}
        for case in cases
        for seed in range(options.seeds)
        for arm, episodes in episodes_of(case, seed, options).items()
    ]
    report(pd.DataFrame(found), cases, options)
    return 0


def folder_of(case: Case, seed: int, options: Any) -> Path:
    """Of the loop on a case's valve with a training seed."""
    return options.work / f"{case.name}, seed {seed}"


def episodes_of(case: Case, seed: int, options: Any) -> dict[str, EpisodeMetrics]:
    """Episodes on a case's valve, by arm."""
    own = Options(
        out=folder_of(case, seed, options), seed=seed, timesteps=options.timesteps,
        episodes=options.episodes, duration=options.duration, controllers=(),
    )  # fmt: skip
    true = true_valve(case)
    record(case, true, own.out)

    def mounted(policy: Controller) -> Controller:
        return UnevenLag(policy, case.unevenness) if case.unevenness else policy

    results = loop(own, mounted)
    results |= deployed(EVERYTHING, load_plant(None), whole_catalogue(), own, mounted)
    results |= deployed(TRUTH, true, "exact", own, mounted)
    itself = {
        scenario: episodes
        for (plants, scenario, _), episodes in results.items()
        if plants == "calibrated"
    }
    return {arm: itself[f"{stage}, {MEASURED}"] for stage, arm in ARMS.items()}


def true_valve(case: Case) -> Plant:
    """The valve on the bench: as built, with the case's effects."""
    unit = draw_unit(np.random.default_rng([SEED, CASES.index(case)]))
    parameters = unit.replace(**case.sizes)
    return Plant(parameters=parameters, region=Region(centre=parameters), name=case.name)


def record(case: Case, true: Plant, folder: Path) -> None:
    """Write the valve, its recordings, and a diagnosis by a catalogue without the case's names."""
    save_plant(true, folder / WITHHELD)
    campaign, diagnosis = folder / CAMPAIGN, folder / DIAGNOSIS
    if not (campaign / FILE_NAME).exists():
        rng = np.random.default_rng([SEED, 1])
        truths = [
            run_programme(true.parameters, programme, form_deviation=case.unevenness, rng=rng)
            for programme in SUITE
        ]
        recorded = measured_campaign(truths, true.parameters, seed=SEED, offsets=NO_OFFSETS)
        write_campaign(recorded, campaign)
    if case.without and not (diagnosis / GAP).exists():
        diagnose_campaign(campaign, diagnosis, without=case.without)


@cache
def whole_catalogue() -> Mixture:
    """Plain domain randomisation: one or two effects of any kind, and ±10 % of the calibrated four."""
    rng, nominal = np.random.default_rng(SEED), Parameters.calibrated()
    drawn = []
    for k in range(RANDOM_PLANTS):
        chosen = rng.choice(len(WORN), size=rng.integers(1, 2, endpoint=True), replace=False)
        sizes = {s.symbol: s.draw(rng, s.drawn or s.mild) for i in chosen for s in WORN[i]}
        region = Region.named("ten_percent", nominal.replace(**sizes))
        drawn.append(Alternative(name=str(k), probability=1 / RANDOM_PLANTS, region=region))
    return Mixture(alternatives=tuple(drawn))


def report(found: pd.DataFrame, cases: Sequence[Case], options: Any) -> None:
    """Write results.csv, the picture and the page's table and sentences."""
    results = pd.DataFrame(
        [figures(name, rows) for name, rows in found.groupby(["case", "arm"], sort=False)]
    )
    write_text(options.out / "results.csv", results.drop(columns="cell").to_csv(index=False))
    shares = results.pivot(index="case", columns="arm", values="left_percent")
    shares = shares.loc[[case.name for case in cases]]
    save_figure(share_picture(shares, MARKS, title="trained on"), options.out / "sim-to-real.png")
    rows = [
        [
            case.name,
            diagnosis_text(folder_of(case, 0, options) / DIAGNOSIS),
            *results["cell"][results["case"] == case.name],
        ]
        for case in cases
    ]
    parts = {"cases": table(["withheld", "diagnosis", *MARKS], rows), "summary": summary(found, results)}
    fill(options.out / PAGE, parts)


def figures(name: Any, rows: pd.DataFrame) -> dict[str, Any]:
    """Of a case and an arm: violation rate, rms error and switchings.

    The interval of the share is the exact one over all episodes, as wide as the training seeds at least.
    """
    stayed, rms, switchings = (
        np.array([getattr(each, key) for each in rows["episodes"]])
        for key in ("stayed", "rms_bar", "switchings_per_s")
    )
    by_seed = 100 * (1 - stayed.mean(axis=1))
    ends = [100 * end for end in violation_interval(stayed.ravel())]
    left, low, high = by_seed.mean(), min(*ends, *by_seed), max(*ends, *by_seed)
    error, often = 1e3 * float(np.sqrt(np.mean(rms**2))), float(switchings.mean())
    return {
        "case": name[0], "arm": name[1], "seeds": len(by_seed), "left_percent": left, "left_low": low,
        "left_high": high, "rms_mbar": error, "switchings_per_s": often,
        "cell": f"{left:.1f} ({low:.1f}–{high:.1f})",
    }  # fmt: skip


def summary(found: pd.DataFrame, results: pd.DataFrame) -> str:
    """What each way of training gives back, and how the diagnosis compares with the whole catalogue."""
    shares = results.pivot(index="case", columns="arm", values="left_percent").mean()
    nominal = shares[ARMS[BEFORE]]
    gained = max(nominal - shares[TRUTH], 1e-9)
    lines = [
        f"- Trained on the {arm}: violation rate {shares[arm]:.1f} % on average. That is "
        f"{100 * (nominal - shares[arm]) / gained:.0f} % of what the truth gives back."
        for arm in (ARMS[AFTER], EVERYTHING)
    ]
    stayed = {
        name: np.concatenate([each.stayed for each in rows["episodes"]]).astype(float)
        for name, rows in found.groupby(["case", "arm"])
    }
    paired = [
        paired_difference(stayed[case, ARMS[AFTER]], stayed[case, EVERYTHING])
        for case in results["case"].unique()
    ]
    better, worse = sum(p.low > 0 for p in paired), sum(p.high < 0 for p in paired)
    lines.append(
        f"- The diagnosis surely beats the whole catalogue for {better} of {len(paired)} valves and is "
        f"surely beaten for {worse} (95 % interval of the difference, paired by episode)."
    )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
