"""A monitor beside any controller: the probability that the valve has changed, when, and what.

It reads what a control unit reads. Every opening of the valve gives a few features. Their departure from
what the model's plant shows, less the valve's own offset, is tested against the effects of the catalogue
by a Shiryaev-Roberts statistic (docs/how-to/monitor-a-valve.md). The first openings give the offset,
whatever the valve; a change that is settled becomes the reference, from which the next one, or the
return, is told. Memory is bounded.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.actions import OnOff
from identification.monitor.features import OpeningReader
from identification.monitor.model import LINEAR, RETURN, UNKNOWN, MonitorModel, polynomial

CLIPPED = 4.0
"""Standard deviations beyond which a departure counts no more: consumption may change in an opening."""
MEMORY = 400
"""Openings over which the valve's own offset is averaged: slow wear is followed."""
UNKNOWN_SHARE, UNKNOWN_SHIFT = 0.2, 4.0
"""Prior probability of an unknown change [-], and its size in each whitened feature [deviations]."""
RETURN_SHARE = 0.2
"""Prior probability of a return, once something has changed [-]."""
CONFIRMED = 2
"""Successive openings with odds beyond the threshold that make an alarm: one alone may lack a row."""
SETTLING = 12
"""Openings from which a valve is learnt at the start, and for which an alarm must last until its change
is settled: its cause needs them."""
RELEARNT = 0.5 * np.pi / SETTLING
"""Variance of the median of these openings, in variances of one: the reference, which an opening with a
jump of consumption does not move."""
CHANGES = 100
"""Settled changes that are remembered."""
LEAST = 1e-300
"""Shortest time [h]: its logarithm must stay a number."""
STRENGTHS = (0.5, 1.0)
"""Sizes of every effect that are tested, as shares of the model's."""


@dataclass(frozen=True)
class Change:
    """A change of the valve, as the monitor saw it when it was settled, or sees it now."""

    onset: float
    """When it began [s]."""
    probability: float
    """That something has changed [-]."""
    causes: dict[str, float]
    """Probability of each effect, UNKNOWN and RETURN, if something has changed, the likeliest first."""
    components: dict[str, float]
    """The same by component."""


class Monitor:
    """Follows one valve: `update` once a control period, beside whatever controller.

    Attributes:
        period: of control [s], in which the features count.
        time: since the start [s].
        probability: that something has changed since the reference was learnt, if changes are as
            frequent as the stated false alarms.
        settled: the latest changes that have become the reference.
        history: the latest (time [s], log odds [-]), for a plot.
        restarts: how often it began anew because its state was not finite.
    """

    period = OnOff.default_period

    def __init__(self, model: MonitorModel, *, false_alarms_per_hour: float = 0.01):
        """Raises ValueError for a rate that is not positive."""
        if not false_alarms_per_hour > 0.0:
            raise ValueError(f"false_alarms_per_hour = {false_alarms_per_hour:g}: give more than 0")
        self.model, self.threshold = model, 1.0 / false_alarms_per_hour
        self.history: deque[tuple[float, float]] = deque(maxlen=10_000)
        self.settled: deque[Change] = deque(maxlen=CHANGES)
        self._reader, self._periods, self.restarts = OpeningReader(), 0, 0
        width = len(model.whiten)
        alone = np.zeros((2 * width, width, LINEAR))
        alone[:, :, 0] = UNKNOWN_SHIFT * np.concatenate([np.eye(width), -np.eye(width)])
        self._shifts = np.concatenate([share * model.shifts for share in STRENGTHS] + [alone])
        unknown = (UNKNOWN,) * len(alone)
        self._names = [*model.effects * len(STRENGTHS), *unknown, RETURN]
        self._parts = [*model.components * len(STRENGTHS), *unknown, RETURN]
        self._weights = _weights(self._names)
        self.restart()

    def restart(self) -> None:
        """Learn the valve anew from its next openings."""
        self._learning = True
        self._possible = np.array([name != RETURN for name in self._names])  # nothing to return from
        self._back = np.zeros((len(self.model.whiten), LINEAR))
        self._reference = self._back.copy()
        self._recent: deque[tuple[NDArray, NDArray]] = deque(maxlen=SETTLING)
        self._before = np.zeros(len(self._back))
        self._refer(self._before)

    def _refer(self, mean: NDArray) -> None:
        """Watch for changes from this state on, which SETTLING openings have on average."""
        self._mean, self._variance = mean.copy(), np.full(len(mean), RELEARNT)
        self._learnt = np.zeros((len(self._names), len(mean)))  # of each shift, by the mean
        # logarithm of the Shiryaev-Roberts statistic of each shift [h]
        self._log = np.full(len(self._names), np.log(LEAST))
        self._since = np.full(len(self._names), self.time)
        self._last, self._alarms = self.time, 0

    def pause(self) -> None:
        """The control unit restarts or skips periods: openings do not reach across."""
        self._reader.pause()

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self._periods * self.period

    @property
    def log_odds(self) -> float:
        """Natural logarithm of the odds that something has changed [-]."""
        return float(np.logaddexp.reduce(self._log + np.log(self._weights)) - np.log(self.threshold))

    @property
    def probability(self) -> float:
        """That something has changed [-]."""
        return float(np.exp(-np.logaddexp(0.0, -self.log_odds)))

    @property
    def alarm(self) -> bool:
        """Whether the statistic has passed the threshold of the stated rate, and still does."""
        return self._alarms >= CONFIRMED

    @property
    def onset(self) -> float:
        """When it changed, if it did [s]."""
        return float(self._shares() @ self._since)

    @property
    def changes(self) -> list[Change]:
        """The settled changes, and that of an alarm that has not settled yet, in order of time."""
        return [*self.settled, *([self._change()] if self.alarm else [])]

    def causes(self) -> dict[str, float]:
        """Probability of each effect, if something has changed, the likeliest first."""
        return self._summed(self._names)

    def components(self) -> dict[str, float]:
        """The same by component."""
        return self._summed(self._parts)

    def update(self, coil: float, U: float, p1: float, p2: float, p3: float, I: float) -> None:  # noqa: E741
        """Take in one control period: readings at its beginning, and the coil's command for it.

        U: voltage of the energised coil [V]; pressures [bar absolute]; I [A].
        """
        self._periods += 1
        found = self._reader.update((coil, U, p1, p2, p3, I))
        if found is not None:
            self.observe(*found)

    def follow(self, rows: NDArray) -> None:
        """Take in a drive (periods, 6): coil, U [V], p1, p2, p3 [bar] and I [A]; a pause precedes it."""
        self.pause()
        for row in rows.tolist():
            self.update(*row)

    @np.errstate(all="ignore")
    def observe(self, conditions: NDArray, z: NDArray) -> None:
        """Take in one opening: conditions (conditions,) and features (features,).

        One that gives numbers that are not finite does not count: a reading was absurd.
        """
        model, spread = self.model, 1.0 + self._variance
        x = polynomial(conditions, model.centre, model.scale)
        limit, linear = CLIPPED * np.sqrt(spread), x[:LINEAR]
        departure = model.whiten @ z - model.expected @ x
        if not np.all(np.isfinite(departure)):
            return
        self._recent.append((departure, linear))
        if self._learning:
            self._learn()
            return
        found = departure - self._reference @ linear - self._mean
        back = self._possible[-1] * (self._before - self._back @ linear - self._mean)
        shift = np.vstack([self._shifts @ linear - self._learnt[:-1], back])
        far = [np.minimum(each**2, limit**2) for each in (found, found - shift)]
        hours = self._possible * (self.time - self._last) / 3600.0
        prior = np.logaddexp(self._log, np.log(np.maximum(hours, LEAST)))
        begun = hours * np.exp(-prior)
        self._since += begun * (self.time - self._since)
        self._log = prior + np.sum((far[0] - far[1]) / spread, axis=1) / 2
        gain = self._variance / spread
        self._learnt *= (1.0 - begun)[:, None]
        self._learnt += gain * np.clip(shift, -limit, limit)
        self._mean += gain * np.clip(found, -limit, limit)
        self._variance = np.maximum(gain, 1.0 / MEMORY)
        self._last = self.time
        state = (self._mean, self._variance, self._learnt, self._log, self._since)
        if not all(np.all(np.isfinite(each)) for each in state):
            self.restarts += 1
            self.restart()
        self.history.append((self.time, self.log_odds))
        self._alarms = self._alarms + 1 if self.log_odds > 0.0 else 0
        if self._alarms == SETTLING:
            self._settle()

    def _learn(self) -> None:
        """The first openings become the reference."""
        if len(self._recent) == SETTLING:
            self._learning = False
            self._refer(np.median([departure for departure, _ in self._recent], axis=0))

    def _settle(self) -> None:
        """The present state becomes the reference; the latest change can be taken back from now on."""
        shares = self._shares()
        likeliest = int(np.argmax(shares))
        self.settled.append(self._change())
        returned = likeliest == len(self._shifts)
        self._back = -self._back if returned else self._shifts[likeliest]
        self._reference = self._reference + self._back
        self._possible[-1] = True
        self._before = self._mean - shares @ self._learnt
        self._refer(np.median([z - self._reference @ x for z, x in self._recent], axis=0))

    def _change(self) -> Change:
        return Change(self.onset, self.probability, self.causes(), self.components())

    def _shares(self) -> NDArray:
        """Probability of each shift, if something has changed."""
        logs = self._log + np.log(self._weights)
        return np.exp(logs - np.logaddexp.reduce(logs))

    def _summed(self, names: list[str]) -> dict[str, float]:
        sums = dict.fromkeys(names, 0.0)
        for name, share in zip(names, self._shares(), strict=True):
            sums[name] += float(share)
        return dict(sorted(sums.items(), key=lambda item: -item[1]))


def _weights(names: list[str]) -> NDArray:
    """Prior of each shift: UNKNOWN_SHARE, RETURN_SHARE, the rest evenly."""
    count = {name: names.count(name) for name in names}
    shares = {UNKNOWN: UNKNOWN_SHARE, RETURN: RETURN_SHARE}
    known = (1.0 - UNKNOWN_SHARE) / max(len(count) - len(shares), 1)
    return np.array([shares.get(name, known) / count[name] for name in names])
