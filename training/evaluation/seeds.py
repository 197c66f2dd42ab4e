"""First seeds of all episodes of `training`: a range of its own for each purpose.

An episode depends on its seed alone, so an episode of training, tuning or selection says nothing about
a controller's performance on new ones. A range goes from its first seed up to the next range's
(tests/training/test_seeds.py says how much of it the commands use).
"""

TRAINING_SEED = 0
"""Training with seed k uses as many from k times its number of environments on (`training_seeds`)."""

TUNING_SEED = 1_000_000
"""On which the classic controllers are tuned, and one of several training seeds is chosen."""

EVALUATION_SEED = 2_000_000
"""On which controllers are compared, and deployed in the sim-to-real loop."""

VALIDATION_SEED = 3_000_000
"""On which a training chooses among the policies that it passes through."""

DISTILLATION_SEED = 4_000_000
"""On which a student imitates a privileged controller; each training seed has its own stretch."""

SWEEP_SEED = 5_000_000
"""Of sweeps and their worst-case searches; --seed counts from here."""

CALIBRATION_SEED = 6_000_000
"""On whose states an export calibrates its integers."""

STATES_SEED = 7_000_000
"""On whose states an export compares its code with the policy."""

CLOSED_LOOP_SEED = 8_000_000
"""That an export's compiled code controls."""

TIMING_SEED = 9_000_000
"""Of the episode in which decisions are timed."""

BENCHMARK_SEED = 10_000_000
"""On which the benchmark scores algorithms (docs/results/benchmark.md)."""


def distillation_seeds(seed: int, count: int) -> range:
    """Of the episodes of a distillation. Raises ValueError if others are swept on them."""
    return _stretch(DISTILLATION_SEED, seed, count, end=SWEEP_SEED, kept_for="sweeps")


def training_seeds(seed: int, num_envs: int) -> range:
    """Of the first episodes of a training. Raises ValueError if others are tuned on them."""
    return _stretch(TRAINING_SEED, seed, num_envs, end=TUNING_SEED, kept_for="tuning")


def _stretch(begin: int, seed: int, count: int, *, end: int, kept_for: str) -> range:
    """The training seed's stretch of the range from `begin` to `end`, where others' episodes begin."""
    first = begin + seed * count
    if first + count > end:
        most = (end - begin) // count - 1
        raise ValueError(
            f"training seed {seed} would meet episodes kept for {kept_for}: give one up to {most}"
        )
    return range(first, first + count)
