"""The benchmark's episodes and figures: what docs/results/benchmark.md compares algorithms by.

from training.evaluation.benchmark import score

print(score(controller))  # anything with name, environment, reset(n) and act(observations)
"""

from dataclasses import dataclass

from controllers.base import Controller
from training.evaluation.metrics import summary
from training.evaluation.rollout import run_batches
from training.evaluation.seeds import BENCHMARK_SEED

EPISODES = 128
"""Episodes of a score: seeds from BENCHMARK_SEED on."""
DURATION = 10.0
"""Length of an episode [s]: the environments' own time limit."""
SIDE_BY_SIDE = 256
"""Episodes that are run together."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure that algorithms are compared by."""

    name: str
    """In result files."""
    heading: str
    factor: float = 1.0
    """From the file's unit to the heading's."""
    digits: str = ".0f"
    """Format of a number in tables."""


FIGURES = (
    Figure(name="mean_return", heading="return"),
    Figure(name="left_share", heading="left ±500 mbar [%]", factor=100.0, digits=".1f"),
    Figure(name="rms_error_bar", heading="rms error [mbar]", factor=1000.0),
    Figure(name="switchings_per_s", heading="switchings [1/s]", digits=".1f"),
)
"""In the order of the tables; the first one ranks."""


def score(
    controller: Controller, *, episodes: int = EPISODES, duration: float = DURATION
) -> dict[str, float]:
    """The figures of a controller, a trained policy for instance, on the benchmark's episodes.

    The environment is the controller's own with its default plant and scenarios.

    Args:
        controller: decides for all episodes.
        episodes: fewer are for a quick look only: others score on all of them.
        duration: of an episode [s], likewise.
    """
    seeds = range(BENCHMARK_SEED, BENCHMARK_SEED + episodes)
    metrics = run_batches(
        controller, seeds=seeds, duration=duration, options={"threads": 1}, size=SIDE_BY_SIDE
    )
    found = summary(metrics)
    return {
        "mean_return": found["mean_return"], "left_share": 1.0 - found["C1_stayed"],
        "rms_error_bar": found["rms_error_bar"], "switchings_per_s": found["switchings_per_s"],
    }  # fmt: skip
