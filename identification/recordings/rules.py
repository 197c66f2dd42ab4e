"""The limits by which a recording is refused or its noise is read (docs/reference/files.md)."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class RecordingRules:
    """Judgements about recordings."""

    least_rate: float = 500.0
    """Least sampling rate [1/s]: a slower bench misses the armature's movement."""
    harmless_jitter: float = 1e-3
    """Part of a period by which a sample may be off; the steepest signal then moves by less than "
    "noise."""
    most_digits: int = 9
    """Most decimals of a second with which files print times."""
    least_rest: float = 0.5
    """Least duration of a quality recording [s]; statistics of less mean little."""
    least_voltage: float = 1.0
    """Least greatest voltage of a coil that is on at all [V]; noise has 0.012 V."""
    kilopascal_median: float = 50.0
    """Median of a pressure column above which the column is in kPa; the range ends at 16 bar."""
    pascal_median: float = 1e4
    """Median of a pressure column above which the column is in Pa."""
    stuck_time: float = 0.02
    """A reading that stays at the end of a range for this long [s] is stuck ..."""
    stuck_samples: int = 20
    """... if it stays there for this many samples, too; noise moves a live reading."""
    choked_ratio: float = 2.2
    """Pressure over ambient above which outflow is choked (from 1.9 on), with room for noise."""
    shortest_discharge: float = 0.04
    """Duration of a discharge that shows where the pressure falls to [s]."""
    least_fall: float = 0.25
    """Relative fall of a discharge that shows where the pressure falls to."""
    gauge_likeness: float = 0.3
    """Part of the ambient pressure within which a discharge that ends at minus that pressure meets "
    "it."""
    distinct_share: float = 0.2
    """Distinct readings per sample above which the readings are taken for continuous (no grid)."""
    least_codes: int = 10
    """Distinct readings that show a step; the least distance of a few may be several steps."""
    grid_error: float = 0.1
    """Distance from a grid, in its steps, within which a reading lies on it; digits are few."""
    coarse_step: float = 2.0
    """Step over Table 3's noise above which a live channel may read the same throughout: a sensor
    that is somewhat quieter than Table 3's then rarely leaves a code."""
    noise_block: float = 0.05
    """Time over which a drift passes for straight when the noise is read [s]."""


RULES = RecordingRules()
"""The rules of docs/reference/files.md."""
