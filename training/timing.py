"""Time per decision of every controller against the control period: one valve, as an ECU has it.

    python training/timing.py --out runs/timing --controllers pulse PWM runs/ppo

The times are those of this implementation, Python and NumPy, on this machine: processor time of all the
process's threads without garbage collection, because an ECU has neither other programs nor garbage. The
export times the C code (docs/reference/exported-policy.md).
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import gc
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.registry import TUNED_KINDS
from epv_env.common.command_line import check_positive, fail_clearly, writable_folder
from epv_env.common.files import write_json, write_text
from epv_env.plant.consumption import check_scenario
from epv_env.plant.plantfile import load_plant
from epv_env.reward import REFERENCE_PERIOD
from training.evaluation.rollout import begin_episodes, make_env
from training.evaluation.seeds import TIMING_SEED
from training.studies.named_controllers import HELP, named_controllers
from training.studies.result_files import records

WARM_UP_DECISIONS = 50
"""Decisions that are not counted: the first ones compile and fill caches."""


def decision_times(
    controller: Controller, *, decisions: int, seed: int = TIMING_SEED, options: Mapping[str, Any]
) -> NDArray:
    """Processor time of each decision of one valve's episode [s] (decisions,).

    options: of the environment. Only `act` is timed.
    """
    env = make_env(controller, 1, threads=1, **options)
    observation = begin_episodes(env, controller, [seed])
    seconds = np.zeros(WARM_UP_DECISIONS + decisions)
    collects = gc.isenabled()
    gc.disable()  # as timeit does
    try:
        for k in range(len(seconds)):
            begin = time.process_time()
            action = controller.act(observation)
            seconds[k] = time.process_time() - begin
            observation = env.task.step(*env.action.decode(action)).observation
    finally:
        if collects:
            gc.enable()
    return seconds[WARM_UP_DECISIONS:]


def timing_table(seconds: Mapping[str, NDArray], period: float = REFERENCE_PERIOD) -> pd.DataFrame:
    """A row per controller: median, 99.9 % and worst time [us], and their shares of the period [1].

    seconds: times of decisions (decisions,) [s] by controller. period: control period [s].
    """
    rows = [
        {
            "controller": label,
            "decisions": len(times),
            "median_us": 1e6 * float(np.median(times)),
            "p99.9_us": 1e6 * float(np.quantile(times, 0.999)),
            "worst_us": 1e6 * float(np.max(times)),
            "median_share_of_period": float(np.median(times)) / period,
            "worst_share_of_period": float(np.max(times)) / period,
        }
        for label, times in seconds.items()
    ]
    return pd.DataFrame(rows)


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(description="Time per decision against the control period.")
    parser.add_argument("--out", type=writable_folder, default=Path("runs/timing"))
    parser.add_argument(
        "--controllers", nargs="+", default=None, metavar="KIND|FOLDER",
        help=f"{HELP}; default: every tuned kind",
    )  # fmt: skip
    parser.add_argument("--decisions", type=int, default=4000, help="of each controller")
    parser.add_argument("--scenario", default="steps", help="consumption of the episode")
    parser.add_argument("--plant", default=None, help="plant file; default: the report's calibration")
    chosen = parser.parse_args(arguments)
    check_positive(parser, chosen, "decisions")
    return chosen


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    plant = load_plant(chosen.plant)
    options = {"plant": plant, "scenario": check_scenario(chosen.scenario)}
    sources = chosen.controllers or TUNED_KINDS
    controllers, _ = named_controllers(sources, plant)
    table = timing_table(
        {
            label: decision_times(controller, decisions=chosen.decisions, options=options)
            for label, controller in controllers.items()
        }
    )
    write_text(chosen.out / "timing.csv", table.to_csv(index=False))
    write_json(chosen.out / "timing.json", records(table))
    print(table.to_string(index=False, float_format="%.4g"))
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
