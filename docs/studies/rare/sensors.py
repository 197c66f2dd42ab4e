"""Sensors that fail, alone and in pairs, from a random instant: worst excursion, share that leaves.

python -m docs.studies.rare.sensors    # writes sensors.csv and the table of README.md
"""

import sys
from collections.abc import Sequence
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.policy import load_policy
from controllers.tuned import tuned
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.reward import BAND_BAR
from training.evaluation.rollout import begin_episodes, make_env, run_begun
from training.evaluation.seeds import RANGE, STATEMENT_SEED
from training.evaluation.sensor_faults import CHANNELS, FAULTS, SensorFaults

FOLDER = Path(__file__).parent
EPISODES = 12
"""Of each fault alone; a quarter of it of each pair."""
FIRST_SEED = STATEMENT_SEED + RANGE
BEHIND = ("adaptive pulse", "extrapolating hysteresis")
"""Controllers whose sensors fail beside the policy's."""
KINDS = FAULTS[:-1]
"""Every fault of one sensor; swapped sensors are two."""
BEGINS_S, DURATION_S = (1.0, 6.0), 8.0
"""When a fault begins, and how long an episode is [s]."""
SINGLE = [(fault,) for fault in product(CHANNELS, KINDS)]
PAIRS = [
    pair for pair in combinations(product(CHANNELS, KINDS), 2) if len({name for name, _ in pair}) == 2
]


def worst_excursions(controller: Controller, cases: list[Any], first_seed: int) -> NDArray:
    """Largest |p2 - target|, (cases,) [bar]; an episode for each case.

    cases: (channel, fault) pairs in each.
    """
    n, rng = len(cases), np.random.default_rng(first_seed)
    options = {"scenario": "mixed", "parameters": "sensitive_ten_percent", "threads": 1}
    env = make_env(controller, n, **options)
    seen = begin_episodes(env, controller, list(range(first_seed, first_seed + n)))
    period = env.settings.control_period
    meters = run_begun(
        env, controller, seen, periods=round(DURATION_S / period),
        faults=SensorFaults(cases, rng.uniform(*BEGINS_S, n) / period, rng),
    )  # fmt: skip
    return np.where(meters["failed"] > 0, np.inf, meters["excursion"])


def fault_table(controllers: dict[str, Controller], episodes: int, first_seed: int) -> pd.DataFrame:
    """A row for each case and controller: share that leaves [%], worst excursion [bar].

    episodes: of each single fault; a quarter of it of each pair.
    """
    cases = [case for case in SINGLE for _ in range(episodes)]
    cases += [case for case in PAIRS for _ in range(max(episodes // 4, 1))]
    named = [" and ".join(f"{channel} {fault}" for channel, fault in case) for case in cases]
    rows = []
    for label, controller in controllers.items():
        worst = worst_excursions(controller, cases, first_seed)
        rows.append(pd.DataFrame({"fault": named, "controller": label, "worst_bar": worst}))
    groups: Any = pd.concat(rows).groupby(["fault", "controller"], sort=False)["worst_bar"]
    shares = groups.agg(lambda worst: 100 * np.mean(worst > BAND_BAR))
    return pd.DataFrame({"left_percent": shares, "worst_bar": groups.max()}).reset_index()


def page_table(found: pd.DataFrame) -> str:
    """Faults of one sensor where some controller left: share that leaves, and worst excursion."""
    worst = found["worst_bar"].map("{:.2f}".format).replace("inf", "empties")
    text = found["left_percent"].map("{:.0f}%, ".format) + worst
    found = found[found.groupby("fault")["left_percent"].transform("max") > 0]
    wide = found.assign(text=text).pivot(index="fault", columns="controller", values="text")
    single = [f"{channel} {fault}" for ((channel, fault),) in SINGLE]
    rows = wide.loc[[name for name in single if name in wide.index]].reset_index()
    return table(list(rows.columns), rows.to_numpy().tolist())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the episodes; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    controllers: dict[str, Any] = {"PPO": load_policy(), **{name: tuned(name) for name in BEHIND}}
    found = fault_table(controllers, 1 if options.quick else EPISODES, FIRST_SEED)
    found.to_csv(options.out / "sensors.csv", index=False, float_format="%.3g")
    fill(options.out / PAGE, {"sensors": page_table(found)})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
