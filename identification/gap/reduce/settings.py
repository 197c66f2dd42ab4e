"""Settings of the discrepancy reduction on held-out recordings."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ReductionSettings:
    """Judgement in gaps, their intervals, the noise floor and the black box."""

    # Block bootstrap

    block_duration: float = 6.0
    """Length of a bootstrap block [time scales]: longer than a transient."""

    block_share: float = 0.05
    """The same relative to the run [1], where that is less: enough blocks in slow plants."""

    least_block_samples: int = 20
    """Length of the shortest block [samples], for plants with a long sampling period."""

    draws: int = 2000
    """Number of bootstrap draws: the ends of a 90 % interval then vary by about one percent of its
    width."""

    interval_level: float = 0.9
    """Share of the draws within an interval, and probability within every interval of the report."""

    least_concentration: float = 0.05
    """Lower bound of the Dirichlet parameter of the block weights [1]; below it one block has all
    weight."""

    # Noise floor

    jump_limit: float = 4.0
    """Difference of consecutive residuals beyond which it is a jump of the misfit [standard
    deviations]."""

    jump_iterations: int = 20
    """Most iterations of the limit of jumps, which usually settles earlier."""

    white_noise_tolerance: float = 0.1
    """Relative growth of squared differences, from one to four readings, up to which the residual is
    taken for white [1]: then it is less than 3 % of the noise."""

    white_noise_deviations: float = 3.0
    """The same in standard deviations of the growth, where the readings tell less."""

    least_slow_growth: float = 1.0
    """Growth from two to four readings, relative to that from one to two [1], from which a slow course
    lies over white noise: between twice of a rough course and half of noise correlated over two
    readings."""

    least_white_share: float = 0.5
    """Share of white noise in the squared differences of neighbours [1] below which it is not told from
    what else changes."""

    share_steps: int = 1000
    """Number of steps between 0 and 1 in which the interval of a share is searched."""

    # Black box

    history_unit: float = 0.1
    """Unit of the lags below [time scales], or the sampling period if that is longer: a transient has
    about ten."""

    history_lags: tuple[int, ...] = (1, 2, 4, 10, 20, 40, 100, 400)
    """Lags at which the black box sees inputs and outputs [history units]: 0.1 to 4 time scales for
    transients, to 40 for what they leave."""

    fewest_learning_samples: int = 2000
    """Samples of all learning runs together that a stride of the history unit must leave; fewer have a
    shorter stride: one sample tells little through its noise."""

    random_features: int = 300
    """Number of random Fourier features; computing time."""

    shortest_wave: float = 0.2
    """Shortest length of a random feature, in typical distances of two samples [1]."""

    longest_wave: float = 3.0
    """Longest length of a random feature, in typical distances of two samples [1]."""

    feature_limit: float = 10.0
    """Bound of a standardised feature [standard deviations], for samples unlike all others."""

    penalty_decades: tuple[float, float] = (-3.0, 5.0)
    """Decimal logarithms of the smallest and the largest ridge penalty [1]: from none to no
    prediction."""

    penalties: int = 9
    """Number of penalties, one per decade."""

    # Predictability

    permutations: int = 1999
    """Number of random orders of blocks behind a p-value, which is then at least 0.0005."""

    significance: float = 0.01
    """p-value below which a prediction is not chance."""

    least_gap_closed: float = 0.02
    """Gap that a prediction must close to matter [noise deviations]."""

    least_share_closed: float = 0.05
    """The same as a share of the explainable gap [1]; the larger of both holds."""
