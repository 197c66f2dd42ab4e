"""First seeds of all episodes of `training`: a range of its own for each purpose.

An episode depends on its seed alone, so an episode of training, tuning or selection says nothing about
a controller's performance on new ones. A range goes from its first seed up to the next range's.
"""

import numpy as np

TRAINING_SEED = 0
"""Of the episodes that policies are trained on (`first_training_seed`)."""

TUNING_SEED = 1_000_000
"""On which the classic controllers are tuned."""

EVALUATION_SEED = 2_000_000
"""On which controllers are compared, and deployed in the sim-to-real loop."""

VALIDATION_SEED = 3_000_000
"""On which a training chooses among the policies that it passes through."""

SELECTION_SEED = 4_000_000
"""On which the best of several trainings is chosen."""

SWEEP_SEED = 5_000_000
"""Of sweeps; --seed counts from here."""

STATES_SEED = 7_000_000
"""On whose states an export compares its code with the policy."""

CLOSED_LOOP_SEED = 8_000_000
"""That an export's compiled code controls."""

TIMING_SEED = 9_000_000
"""Of the episode in which decisions are timed."""

STATEMENT_SEED = 10_000_000
"""Of the episodes that docs/studies/rare announces before it runs them."""

RANGE = 1_000_000
"""Seeds of a range."""


def first_training_seed(seed: int, steps: int, num_envs: int) -> int:
    """Seed of the first of the episodes that a training begins after so many environment steps.

    The next environments have the next seeds. seed: of the training.
    """
    rng = np.random.default_rng([seed, steps])
    return int(rng.integers(TRAINING_SEED, TRAINING_SEED + RANGE - num_envs))


def check_first_seed(seed: int, episodes: int) -> None:
    """Raises ValueError if so many episodes from `seed` on would leave their range."""
    if seed + episodes > RANGE:
        raise ValueError(
            f"--seed {seed} would meet episodes kept for others: with {episodes} episodes "
            f"give one up to {RANGE - episodes}"
        )
