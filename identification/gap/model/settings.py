"""Settings of what happens before a diagnosis: checks of the plant, its noise and its time scale."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class PreparationSettings:
    """Judgement in the checks at the door and in the noise that is estimated from readings."""

    # Noise of the readings

    noise_block_readings: int = 20
    """Length of a block whose noise is estimated by itself [readings]: four blocks in a run of 80
    readings, and motion in some of them does not move the median."""

    difference_orders: tuple[int, ...] = (2, 4)
    """Orders of the differences of neighbouring readings that show the noise; the least estimate counts.
    The second (Gasser 1986) suffices for finely sampled runs; the fourth removes the motion of runs with
    a few dozen readings per transient as well."""

    largest_rounding: float = 1e-9
    """Distance of two readings that is rounding of the same value, relative to all readings' range
    [1]."""

    step_quantile: float = 0.1
    """Quantile of the distances of neighbouring values that is tried as the step of a quantised channel
    [1]: most values of a range occur, so that a small quantile is one step."""

    step_tolerance: float = 0.05
    """Distance of a difference from the next multiple of the step up to which it is one [steps]."""

    share_of_multiples: float = 0.95
    """Share of differences that must be multiples of the step [1]: all but faulty readings."""

    fewest_values: int = 4
    """Fewest distances of neighbouring values that can show a step: by chance two may be alike."""

    # Checks

    uneven_period: float = 0.01
    """Largest deviation of a sampling instant from a uniform course [sampling periods]: rounding of a
    logger's clock."""

    trial_step: float = 0.05
    """Change of a calibrated parameter that must show in the outputs, as a share of its range [1]: far
    beyond rounding, and small enough that the model can be simulated."""

    least_effect: float = 1e-9
    """Change of the outputs that is no effect, relative to their magnitude [1]: rounding."""

    side_by_side_error: float = 1e-3
    """Largest difference between a candidate alone and the same one beside another, relative to the
    outputs' magnitude [1]: a solver whose steps candidates share differs by less, mixed-up candidates by
    more."""

    alike: float = 0.999
    """Correlation of the changes by two calibrated parameters from which they act alike [1]: recordings
    then determine one number for both."""

    trial_windows: int = 2
    """Windows of the trial of `forced`: enough to see mixed-up axes."""


@dataclass(frozen=True, kw_only=True)
class TimeScaleSettings:
    """Judgement in how fast a plant moves, as its readings show."""

    widening: float = 1.25
    """Ratio of successive widths over which readings are averaged before their changes are taken [1]:
    fine enough that the choice of a width hardly moves the result."""

    clear_signal: float = 100.0
    """Variance of changes relative to that of noise alone [1] from which a width needs no further
    averaging: enough even where the noise is three times as large as the plant says."""

    least_signal: float = 3.0
    """The same below which a channel shows no motion at all [1]: what noise reaches by chance."""

    fewest_widths: int = 8
    """Fewest averaging widths that the shortest run must hold [1]: fewer show no course."""

    still_share: float = 0.01
    """Time scale of a plant whose readings show no motion, relative to its shortest run [1]: some
    hundred stretches tell chance from rule."""
