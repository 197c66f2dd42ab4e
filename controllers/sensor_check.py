"""The check of the sensors in front of a policy: what becomes of readings that a valve cannot show.

A reading is lost if it is not finite, lies beyond the ends of its sensor, or contradicts the valve's own
equations after the last good one:

- p1 is a reservoir's: it does not jump.
- The coil decides where p3 goes: on, the control chamber fills up to p1; off, it empties to the ambient
  pressure. So p3 never goes the other way, and never lies above p1.

For HELD periods the last good reading takes a lost one's place. More losses than good readings make up
for, or a p3 that stands still far from the end that it goes to, end the trust until the reset: a
hysteresis takes over that reads neither p1 nor p3. Without p2 and a target it is blind, and the coil
stays on.

The compiled functions work on one valve with plain arithmetic, so that they can be translated to C.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import compiled, composed
from controllers.hysteresis import two_points
from epv_env.observation import HISTORY, read, write
from epv_env.plant.channels import CURRENT, P1, P2, P3, Sensor

HELD = 3
"""Control periods for which a reading is held: fewer than the four after which p3 stands still."""
FORGIVEN = 1 / 8
"""Lost readings that a good one makes up for [1]: a sensor with random values does not recover."""
WAIT = 25e-3
"""Time for which the coil has been as it is before p3 must obey it [s]: the armature's delay, the
latency of the command, and the four periods over which the change is observed."""
JUMP = 0.5
"""Most that p1 changes between two readings [bar]: a refill within a second changes it by 0.08."""
FASTEST = 300.0
"""Fastest change of p3 [bar/s]: a chamber fills with 180 bar/s and empties with 150 bar/s at most."""
AGAINST = 0.3
"""Most that p3 seems to move against the coil in a period [bar]: seven standard deviations of two
readings' difference with four times Table 3's noise."""
STILL = 0.02
"""Change over four periods below which p3 stands still [bar]: twice the standard deviation that Table
3's noise gives it. A chamber that fills or empties moves many times as much."""
MARGIN = 0.4
"""Distance of p3 from the end that it goes to, within which it may stand still; most that it may lie
above p1 [bar]. Table 1 allows each sensor 0.256, in squares 0.36 together."""
FAR = 3.0
"""Distance from which one period shows whether p3 moves [bar]: it then moves by 0.15 bar or more."""
AMBIENT = 1.0
"""Pressure that the chamber empties to [bar]."""
MOST_PERIODS = 65535.0
"""Periods at which a counter stays."""

CHANNELS = {"p1": P1, "p2": P2, "p3": P3, "current": CURRENT, "target": P2}
"""Whose ends bound each reading: a target beyond the sensor of p2 cannot be followed."""
COUNT = len(CHANNELS)
_P1, _P2, _P3, _CURRENT, _TARGET = range(COUNT)

START = np.array([10.0, 8.0, 8.0, 0.3, 8.0])
"""What is held before the first good readings, (5,) [bar, A]: the middle of the observation."""

SENSES = np.dtype(
    (
        np.record,
        [
            ("last", np.float64, (COUNT,)),  # CHANNELS: the last good readings [bar, A]
            ("p2_history", np.float64, (HISTORY,)),  # held readings, the newest first [bar]
            ("p3_history", np.float64, (HISTORY,)),
            ("lost", np.float64),  # periods in which a reading was lost, less what good ones made up for
            ("whole", np.float64),  # latest periods in a row without a loss
            ("periods", np.float64),  # since the reset
            ("begun", np.float64),  # 1: all readings were good once, or HELD is over
            ("blind", np.float64),  # 1: p2 or the target is lost now
            ("failed", np.float64),  # 1: the hysteresis has taken over
            ("fallback", np.float64),  # what the hysteresis decides
        ],
    )
)
"""What the check remembers of one valve."""


class Ends(NamedTuple):
    """Least and greatest good reading of CHANNELS, (5,) each [bar, A]."""

    least: NDArray
    greatest: NDArray


def ends_of(sensors: Mapping[str, Sensor]) -> Ends:
    """The sensors' ends, by channel; a step of the converter beyond them is allowed."""
    ends = [
        (*each.constants()[3:], each.resolution) for each in (sensors[c.name] for c in CHANNELS.values())
    ]
    return Ends(*np.array([[low - step, high + step] for low, high, step in ends]).T.copy())


@compiled
def is_good(value, ends, i):
    """Whether a reading is good; NaN is not."""
    return value >= ends.least[i] and value <= ends.greatest[i]


@compiled
def settled(s, r, period):
    """Whether p3 must obey the coil: it has been as it is for WAIT."""
    # What happened before the first observation is not known: the coil may have switched just then.
    known = min(r.waited, s.periods * period)
    return known > WAIT - period / 2  # whole periods


@compiled
def can_follow(s, r, period):
    """Whether a reading of p3 can follow the last good one; p1 has been held before."""
    change = r.p3 - s.last[_P3]
    fastest = FASTEST * period * (1 + s.lost)  # the last good one may be as old
    if r.p3 > s.last[_P1] + MARGIN or abs(change) > fastest:
        return False
    against = change if r.coil < 0.5 else -change
    return against <= AGAINST or not settled(s, r, period)


@compiled
def keep(s, i, value, good):
    """Keep a channel's reading if it is good; gives the number of lost ones, 0 or 1."""
    if good:
        s.last[i] = value
        return 0.0
    return 1.0


@compiled
def begin(s):
    """An episode begins: until readings are good, START is held."""
    for i in range(COUNT):
        s.last[i] = START[i]
    s.whole, s.fallback = HISTORY, 1.0


@compiled
def hold(s, r, ends, period):
    """Tell the good readings from the lost ones, for which the last good ones stand."""
    if s.periods == 0:
        begin(s)
    s.periods = min(s.periods + 1, MOST_PERIODS)
    target = is_good(r.target, ends, _TARGET)
    p2 = is_good(r.p2, ends, _P2) and target  # an observation shows p2 by its distance from the target
    s.blind = 0.0 if p2 else 1.0
    p1 = is_good(r.p1, ends, _P1) and (s.begun == 0 or abs(r.p1 - s.last[_P1]) <= JUMP)
    lost = keep(s, _P1, r.p1, p1)
    p3 = is_good(r.p3, ends, _P3) and (s.begun == 0 or can_follow(s, r, period))
    lost += keep(s, _P2, r.p2, p2) + keep(s, _P3, r.p3, p3) + keep(s, _TARGET, r.target, target)
    lost += keep(s, _CURRENT, r.current, is_good(r.current, ends, _CURRENT))
    s.lost = min(s.lost + 1, MOST_PERIODS) if lost > 0 else max(s.lost - FORGIVEN, 0.0)
    s.whole = 0.0 if lost > 0 else min(s.whole + 1, MOST_PERIODS)


@compiled
def remember(s):
    """Keep the held readings; the first ones stand for the past."""
    for k in range(1, HISTORY):
        older = HISTORY - k
        s.p2_history[older] = s.p2_history[older - 1] if s.begun > 0 else s.last[_P2]
        s.p3_history[older] = s.p3_history[older - 1] if s.begun > 0 else s.last[_P3]
    s.p2_history[0], s.p3_history[0] = s.last[_P2], s.last[_P3]
    if s.whole > 0 or s.lost > HELD:
        s.begun = 1.0


@compiled
def show(s, r, observation):
    """Write what is held, and its changes, into an observation (entries,) [-]; read it again."""
    write(observation, s, s.last[_P1], s.last[_CURRENT], s.last[_TARGET], r.coil, r.waited)
    read(r, observation)


@compiled
def implausible(s, r, period):
    """Whether p3 stands still where the coil should move it."""
    p3 = s.last[_P3]
    remains = s.last[_P1] - p3 if r.coil > 0.5 else p3 - AMBIENT
    still = abs(r.p3_change[1]) < STILL and remains > MARGIN
    # A lost reading is held, which is no sign that p3 stands still.
    still_far = abs(r.p3_change[0]) < STILL and remains > FAR and s.whole > 0
    return (still or still_far) and settled(s, r, period)


@compiled
def watch(s, r, thresholds, period):
    """Judge the sensors by held readings; the hysteresis follows every valve."""
    if s.lost > HELD or implausible(s, r, period):
        s.failed = 1.0
    s.fallback = two_points(s.fallback, r, thresholds, period)


@composed
def checked(s, r, observation, ends, thresholds, period):
    """Check the readings of an observation (entries,), and put what is held into both."""
    hold(s, r, ends, period)
    remember(s)
    if s.whole < HISTORY:  # a change over past readings reaches back to a loss
        show(s, r, observation)
    watch(s, r, thresholds, period)


@compiled
def overruled(s, action):
    """What the coil does, 0 (off) or 1 (on), if the policy wants `action`."""
    if s.begun == 0 or (s.failed > 0 and s.blind > 0):
        return 1.0  # there is nothing to decide by
    return s.fallback if s.failed > 0 or s.whole == 0 else action
