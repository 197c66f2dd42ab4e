"""First seeds of all episodes of `training`: a range of its own for each purpose.

An episode depends on its seed alone, so an episode of training, tuning or selection says nothing about
a controller's performance on new ones. A range goes from its first seed up to the next range's.
"""

TRAINING_SEED = 0
"""Training with seed k uses as many from k times its number of environments on (`training_seeds`)."""

TUNING_SEED = 1_000_000
"""On which the classic controllers are tuned."""

EVALUATION_SEED = 2_000_000
"""On which controllers are compared, and deployed in the sim-to-real loop."""

VALIDATION_SEED = 3_000_000
"""On which a training chooses among the policies that it passes through."""

SWEEP_SEED = 5_000_000
"""Of sweeps; --seed counts from here."""

STATES_SEED = 7_000_000
"""On whose states an export compares its code with the policy."""

CLOSED_LOOP_SEED = 8_000_000
"""That an export's compiled code controls."""

TIMING_SEED = 9_000_000
"""Of the episode in which decisions are timed."""

RANGE = 1_000_000
"""Seeds of a range."""


def training_seeds(seed: int, num_envs: int) -> range:
    """Of the first episodes of a training. Raises ValueError if others are tuned on them."""
    first = TRAINING_SEED + seed * num_envs
    if first + num_envs > TUNING_SEED:
        most = (TUNING_SEED - TRAINING_SEED) // num_envs - 1
        raise ValueError(
            f"training seed {seed} would meet episodes kept for tuning: give one up to {most}"
        )
    return range(first, first + num_envs)


def check_first_seed(seed: int, episodes: int) -> None:
    """Raises ValueError if so many episodes from `seed` on would leave their range."""
    if seed + episodes > RANGE:
        raise ValueError(
            f"--seed {seed} would meet episodes kept for others: with {episodes} episodes "
            f"give one up to {RANGE - episodes}"
        )
