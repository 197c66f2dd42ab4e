"""The openings of a valve in what its control unit reads, and the features of each."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

BEFORE, AFTER = 8, 5
"""Control periods with the coil on that an opening needs before and after."""
SHORTEST, LONGEST = 9, 40
"""Control periods with the coil off that it may have."""
REST, FLAT = 0.3, 0.04
"""Distance of p3 from p1, and range of p3 over five periods, below which the chamber rests [bar]."""
RISE = 0.06
"""Rise of p2 over its trend that tells that the valve is open [bar]: six times the noise."""
SHUT = 5
"""Control periods after the command in which the valve cannot be open yet."""

FEATURES = (
    "I_off_1", "I_off_2", "I_on_1", "I_on_2", "I_on_3", "p3_rest", "p3_off_1", "p3_off_2",
    "p3_vents_early", "p3_vents_late", "p3_opens", "time_opens", "p2_rise", "p2_rise_1", "p2_rise_2",
    "p2_rise_whole", "p3_fills_1", "p3_fills_2", "p3_fills_late",
)  # fmt: skip
"""What `features` returns, in this order."""
CONDITIONS = ("p1", "p2", "open", "U", "I_on", "slope")
"""Conditions of an opening: pressures [bar], periods open, voltage [V], current of the held coil per
voltage [A/V], which tells how warm the winding is, slope of p2 [bar/period]."""


@np.errstate(all="ignore")
def features(rows: NDArray) -> tuple[NDArray, NDArray] | None:
    """Conditions and features of one opening; None without all readings, rest before, or an opening.

    rows: (BEFORE + periods off + AFTER, 6) with coil, U [V], p1, p2, p3 [bar] and I [A].
    """
    if not (np.all(np.isfinite(rows)) and rows[BEFORE - 1, 1] > 0.0):
        return None
    U, p1, p2, p3, I = rows[:, 1:].T  # noqa: E741
    i, j = BEFORE, len(rows) - AFTER
    voltage, supply = U[i - 1], p1[:i].sum() / i
    rest = p3[i - 4 : i + 1].sum() / 5
    if abs(rest - supply) > REST or np.ptp(p3[i - 4 : i + 1]) > FLAT or p3[i + 1 : j].min() <= 0.0:
        return None
    n = i + SHUT
    t = np.arange(len(rows)) - (n - 1) / 2
    slope = t[:n] @ p2[:n] / (n * (n * n - 1) / 12)
    trend = p2[:n].sum() / n + slope * t
    rise = p2 - trend
    above = rise > RISE
    at = n + int(np.argmax(above[n : j + 3] & above[n + 1 : j + 4]))
    if not (above[at] and above[at + 1]) or above[at - 1]:
        return None
    part = (RISE - rise[at - 1]) / (rise[at] - rise[at - 1])
    opens = at - 1 + part
    current = I / voltage
    log = np.log(p3[[i + 1, i + 2, i + 5, i + 9]])
    z = np.array(
        [
            *current[i + 1 : i + 3], *current[j + 1 : j + 4],
            rest - supply, log[0] - np.log(rest), log[1] - np.log(rest), log[2] - log[1],
            log[3] - log[2], p3[at - 1] + part * (p3[at] - p3[at - 1]), opens - i,
            *rise[j : j + 3], rise[j + 3 : j + 5].sum() / 2, p3[j + 1] - p3[j], p3[j + 2] - p3[j + 1],
            p3[j + 4] - p3[j + 2],
        ]
    )  # fmt: skip
    held = current[i - 2 : i + 1].sum() / 3
    return np.array([supply, trend[i], j - opens, voltage, held, slope]), z


class OpeningReader:
    """Finds the openings in what the control unit reads: `update` once a control period."""

    def __init__(self) -> None:
        """Nothing has been read."""
        self._rows: deque[tuple[float, ...]] = deque(maxlen=BEFORE + LONGEST + AFTER)
        self.pause()

    def pause(self) -> None:
        """Periods are missing: openings do not reach across."""
        self._rows.clear()
        self._on, self._off = 0, -1  # -1: what came before the command is not known

    def update(self, row: tuple[float, ...]) -> tuple[NDArray, NDArray] | None:
        """Conditions (conditions,) and features (features,) of an opening that this period completes.

        row: coil, U [V], p1, p2, p3 [bar] and I [A].
        """
        self._rows.append(row)
        if row[0] < 0.5:
            if self._on:
                self._off = 0 if self._on >= BEFORE else -1
            self._on = 0
            self._off += self._off >= 0
            return None
        self._on += 1
        if self._on == AFTER and SHORTEST <= self._off <= LONGEST:
            return features(np.array(self._rows)[-(BEFORE + self._off + AFTER) :])
        return None
