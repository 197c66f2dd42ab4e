"""Sensors that fail, alone and in pairs, from a random instant: worst excursion, share that leaves.

python -m docs.studies.rare.sensors    # writes sensors.csv and the table of README.md
"""

import sys
from collections import deque
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
from epv_env.observation import HISTORY, LAYOUT, P2_LAGS, P3_LAGS, decode, encode
from epv_env.plant.channels import CURRENT, P1, P2, P3
from epv_env.result import DEVIATION
from epv_env.reward import BAND_BAR
from training.deploy.compiled import readings_of
from training.evaluation.rollout import begin_episodes, make_env
from training.evaluation.seeds import RANGE, STATEMENT_SEED

FOLDER = Path(__file__).parent
EPISODES = 12
"""Of each fault alone; a quarter of it of each pair."""
FIRST_SEED = STATEMENT_SEED + RANGE
BEHIND = ("adaptive pulse", "extrapolating hysteresis")
"""Controllers whose sensors fail beside the policy's."""
CHANNELS = {"p1": P1, "p2": P2, "p3": P3, "current": CURRENT}
FAULTS = ("stuck", "zero", "saturated", "wild", "delayed")
"""At its value; 0; at the sensor's end; uniform in its range in every period; late by DELAY periods."""
DELAY = 20
BEGINS_S, DURATION_S = (1.0, 6.0), 8.0
"""When a fault begins, and how long an episode is [s]."""
SINGLE = [(fault,) for fault in product(CHANNELS, FAULTS)]
PAIRS = [
    pair for pair in combinations(product(CHANNELS, FAULTS), 2) if len({name for name, _ in pair}) == 2
]


def worst_excursions(controller: Controller, cases: list[Any], first_seed: int) -> NDArray:
    """Largest |p2 - target| from the fault on, (cases,) [bar]; an episode for each case.

    cases: (channel, fault) pairs in each.
    """
    n, rng = len(cases), np.random.default_rng(first_seed)
    options = {"scenario": "mixed", "parameters": "sensitive_ten_percent", "threads": 1}
    env = make_env(controller, n, **options)
    seen = begin_episodes(env, controller, list(range(first_seed, first_seed + n)))
    begins = rng.uniform(*BEGINS_S, n)
    fault = np.full((n, len(CHANNELS)), -1)
    for row, case in enumerate(cases):
        for channel, name in case:
            fault[row, list(CHANNELS).index(channel)] = FAULTS.index(name)
    low, high = np.transpose([each.sensor.constants()[3:] for each in CHANNELS.values()])
    true: deque[NDArray] = deque(maxlen=DELAY + 1)
    stuck, worst, past = np.zeros(fault.shape), np.zeros(n), deque(maxlen=HISTORY)
    period = env.settings.control_period
    for step in range(round(DURATION_S / period)):
        now = readings_of(seen)
        true.append(np.stack([now[name] for name in CHANNELS], axis=1))
        acts = step * period >= begins
        stuck = np.where(acts[:, None], stuck, true[-1])
        wild = rng.uniform(low, high, fault.shape)
        broken = np.stack([stuck, 0 * stuck, np.broadcast_to(high, fault.shape), wild, true[0]])
        chosen = np.take_along_axis(broken, np.maximum(fault, 0)[None], axis=0)[0]
        past.append(np.where((fault >= 0) & acts[:, None], chosen, true[-1]))
        result = env.advance(controller.act(np.where(acts[:, None], _shown(past, seen, now), seen)))
        seen = result.observation
        worst = np.where(acts, np.maximum(worst, np.abs(result.figures[DEVIATION])), worst)
        worst[result.failed] = np.inf
    return worst


def _shown(past: deque[NDArray], seen: NDArray, now: dict[str, NDArray]) -> NDArray:
    """The observations (n, entries) that these readings give, the newest last."""
    newest = dict(zip(CHANNELS, past[-1].T, strict=True))
    values = {entry.name: decode(seen, entry.name) for entry in LAYOUT}
    values |= {"p2_error": newest["p2"] - now["target"], "p1": newest["p1"], "p3": newest["p3"]}
    values["I"] = newest["current"]
    for name, lags in (("p2", P2_LAGS), ("p3", P3_LAGS)):
        k = list(CHANNELS).index(name)
        for lag in lags:
            before = past[-1 - lag] if len(past) > lag else past[0]
            values[f"{name}_change_{lag}"] = newest[name] - before[:, k]
    return encode(values)


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
