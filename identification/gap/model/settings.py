"""Settings of the plant's time scale."""

from dataclasses import dataclass


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
