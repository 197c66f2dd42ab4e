"""What a valve's own pulses tell about it: when it opens, how much a pulse adds, how fast it vents.

The table of the nominal plant (controllers/pulse_table.py) is fitted to each valve. The venting rate is
learnt from the fall of ln p3. Opening pressure and gain are learnt by a bank of Kalman filters: each of
its members assumes an offset of the opening pressure and estimates the factor between a pulse's rise and
the table's. How well a member foresees each pulse sets its probability. The filter of p2 is the
fading-memory g-h filter.

Sources: Astrom and Wittenmark, Adaptive Control, 2nd ed. 1995, chapter 3; Magill, IEEE Trans. Automatic
Control 10 (1965), and Simon, Optimal State Estimation (Wiley 2006), section 10.2 (multiple models);
Brookner, Tracking and Kalman Filtering Made Easy (1998), chapter 1.

The compiled functions work on one valve with plain arithmetic, so that they can be translated to C.
"""

import math
from typing import Any

import numpy as np

from controllers.base import compiled
from controllers.pulse_table import gained_at_once, opens_at, time_to_open
from epv_env.observation import Quantity
from epv_env.reward import BAND_BAR

OFFSETS = np.linspace(-2.2, 2.2, 45)
"""Offsets of the opening pressure that the members assume [bar]: 4.4 standard deviations."""
MEMBERS = len(OFFSETS)
OFFSET_SPREAD = 0.5
"""Their standard deviation before the first pulse [bar]: piston, seat and spring within ±10 %."""
OFFSET_DRIFT = 2e-3
"""Share of a member's probability that goes to each neighbour at a correction [1]: the valve may change,
and the seat's diameter makes the offset depend on the pressures."""
GAIN_SPREAD, GAIN_DRIFT = 0.2, 0.02
"""Standard deviation of the gain's factor before the first pulse, and its growth with each [1]."""
LEAST_FACTOR, MOST_FACTOR = 0.4, 2.5
"""Limits of the factors of gain and venting rate [1]."""
GAIN_READING_ERROR = 0.015
"""Standard deviation of a rise's measurement by two readings of p2 [bar]."""
SLOPE_ERROR = 0.7
"""Standard deviation of the consumption's slope during a pulse [bar/s]: it jumps."""
TABLE_ERROR = 0.1
"""Standard deviation of the table's rise beyond a common factor, as a share of it [1]."""
OPEN_RISE, SHUT_RISE = 0.06, 0.02
"""Rise of p2 in a period that shows an open valve, three standard deviations of two readings'
difference, and the rise below which it is seen to be shut [bar]."""
LATE = 0.9
"""p3 over a member's opening pressure at which p2 must have begun to rise [1]."""
CONTRADICTED = 0.1
"""Factor of the probability of a member that p2 contradicts in a period [1]."""
PACE_SPREAD, PACE_DRIFT, PACE_READING_ERROR = 0.2, 1e-3, 0.01
"""Standard deviations of the venting rate's factor before the first reading, of its growth with each
reading, and of p3 over p3 of a reading [1]."""
EMPTY, SHUTTING = 2.0, 0.05
"""p3 below which the coil has been off for longer than any pulse [bar]; time with the coil on that shuts
the valve then [s]."""
PERIODS_AFTER_RELEASE = 3
"""Periods with the coil off from which p3 falls at its full rate: the armature has moved."""
CONFIDENCE, UNKNOWN_CONFIDENCE = 0.95, 0.99
"""Probability that a valve opens no earlier than "early"; that of a valve that is still unknown [1]."""
UNKNOWN_DEVIATION = 0.45
"""Standard deviation of the opening pressure above which a valve is unknown [bar]."""
LEAST_HEAD = 0.2
"""p1 - p2 below which the supply does not raise the circuit [bar]."""
TOLERATED = BAND_BAR - 0.1
"""Expected pressure dip that needs no reserve [bar]: what the band allows, less the scatter at rest."""
MOST_RESERVE = 0.3
"""Largest reserve [bar]: above it a pulse's scatter would leave the band upwards."""
BREAKDOWN_MEMORY, REACHED = 60.0, 0.05
"""Time in which the memory of a pressure dip fades by 1/e [s]; distance below the target from which the
target counts as reached [bar]: the way up to it is no dip."""
FILTER_TIME = 0.025
"""Time in which the weight of a reading of p2 fades by 1/e [s]."""

_STATE = (
    "begun", "plant", "found_open", "off_periods", "on_periods", "was_shut", "slope", "pace_variance",
    "measuring", "end_p1", "end_p2", "end_p3", "end_fall", "reached",
)  # fmt: skip


LEARNT = (
    Quantity("offset", "bar", 0.0, 0.5, 8.0),  # of the opening pressure from the table's
    Quantity("offset_deviation", "bar", 0.0, 0.5, 8.0),
    Quantity("gain", "1", 1.0, 0.2, 8.0),  # rise of a pulse over the table's
    Quantity("gain_deviation", "1", 0.0, 0.2, 8.0),
    Quantity("pace", "1", 1.0, 0.2, 8.0),  # venting rate over the table's
    Quantity("pace_deviation", "1", 0.0, 0.2, 8.0),
    Quantity("error", "bar", 0.0, 0.5, 4.0),  # p2 - target, filtered while the valve is shut
    Quantity("fall", "bar/s", 0.0, 2.0, 4.0),  # rate of change of p2 by consumption, at most 0
    Quantity("opens_in", "s", 0.0, 0.05, 2.0),  # with the coil off from now; negative: it is open
    Quantity("opens_in_early", "s", 0.0, 0.05, 2.0),  # the same if the valve opens early
    Quantity("opens_from_rest", "s", 0.05, 0.05, 2.0),  # from a full control chamber
    Quantity("forecast", "bar", 0.0, 0.5, 4.0),  # p2 - target at the opening, if the coil goes off now
    Quantity("under_way", "bar", 0.0, 0.3, 4.0),  # rise of p2 if the coil is switched on now
    Quantity("after_period", "bar", 0.0, 0.3, 4.0),  # the same after one period more off
    Quantity("after_period_early", "bar", 0.0, 0.3, 4.0),  # the same if the valve opens early
    Quantity("reserve", "bar", 0.0, 0.1, 4.0),  # how much higher p2 is held where the valve is slow
    Quantity("deepest", "bar", 0.0, 0.25, 4.0),  # deepest pressure dip lately
    Quantity("head", "bar", 0.0, 2.0, 2.0),  # p1 - p2
    Quantity("margin", "bar", 0.0, 0.2, 2.0),  # these three: the adaptive pulse (controllers/pulse.py)
    Quantity("remaining", "s", 0.0, 0.02, 2.0),
    Quantity("advised", "1", 0.5, 0.5, 1.0),
)
"""What is known of a valve, as a policy sees it; the advice last."""

VALVE = np.dtype((np.record,
    [
        (name, np.float64)
        for name in (
            *_STATE,
            "on",  # 1 if the coil is on
            "p1", "p2", "p3",  # as read [bar]
            "early_offset",  # `offset` if the valve opens early [bar]
            *(quantity.name for quantity in LEARNT),
        )
    ]
    + [(name, np.float64, (MEMBERS,)) for name in ("probability", "member_gain", "member_variance")]
))  # fmt: skip
"""State of a learner and what it knows of one valve; zeros: an episode begins. plant: its place in
the table. found_open: 1 until a valve that was open at first has been shut."""


@compiled
def begin(v, informed):
    """An episode begins: nothing is known of the valve, or all of it where the table is its own."""
    v.begun = 1.0
    v.pace, v.pace_variance = 1.0, PACE_SPREAD**2
    total = 0.0
    for m in range(MEMBERS):
        v.probability[m] = math.exp(-0.5 * (OFFSETS[m] / OFFSET_SPREAD) ** 2)
        total += v.probability[m]
    for m in range(MEMBERS):
        v.probability[m] /= total
        v.member_gain[m], v.member_variance[m] = 1.0, GAIN_SPREAD**2
    summarise(v)
    if informed:
        v.pace_variance = 0.0
        v.offset = v.offset_deviation = v.early_offset = v.gain_deviation = 0.0
        v.gain = 1.0


@compiled
def summarise(v):
    """Mean and deviation of offset and gain over the members, and an early offset."""
    offset = gain = 0.0
    for m in range(MEMBERS):
        offset += v.probability[m] * OFFSETS[m]
        gain += v.probability[m] * v.member_gain[m]
    spread = gain_spread = 0.0
    for m in range(MEMBERS):
        spread += v.probability[m] * (OFFSETS[m] - offset) ** 2
        around = v.member_variance[m] + (v.member_gain[m] - gain) ** 2
        gain_spread += v.probability[m] * around
    v.offset, v.offset_deviation = offset, math.sqrt(spread)
    v.gain, v.gain_deviation = gain, math.sqrt(gain_spread)
    wanted = UNKNOWN_CONFIDENCE if v.offset_deviation > UNKNOWN_DEVIATION else CONFIDENCE
    below, early = 0.0, MEMBERS - 1
    for m in range(MEMBERS):
        below += v.probability[m]
        if below >= wanted and early == MEMBERS - 1:
            early = m
    v.early_offset = OFFSETS[early]


@compiled
def normalise(v):
    """Make the members' probabilities sum to one."""
    total = 0.0
    for m in range(MEMBERS):
        total += v.probability[m]
    for m in range(MEMBERS):
        v.probability[m] /= total


@compiled
def smear(v):
    """Move a share of each probability to the neighbours: the valve may have changed."""
    before = v.probability[0]
    for m in range(MEMBERS):
        here = v.probability[m]
        after = v.probability[m + 1] if m + 1 < MEMBERS else here
        v.probability[m] = (1 - 2 * OFFSET_DRIFT) * here + OFFSET_DRIFT * (before + after)
        before = here


@compiled
def watch_opening(v, table, t, p1, p2, p3, rise):
    """Doubt members that contradict whether p2 rises while the coil is off.

    rise: of p2 in the last period without what was consumed [bar].
    """
    nominal = opens_at(table, t, p1, p2)
    smear(v)
    for m in range(MEMBERS):
        assumed = nominal + OFFSETS[m]
        too_low = rise > OPEN_RISE and assumed < p3
        too_high = rise < SHUT_RISE and p3 < LATE * assumed
        if too_low or too_high:
            v.probability[m] *= CONTRADICTED
    normalise(v)


@compiled
def learn_pulse(v, table, t, gained, lasted):
    """Correct every member by a pulse that has ended, and weigh the members by their surprise.

    gained: measured rise without what was consumed [bar]. lasted: time between the two readings [s].
    """
    smear(v)
    largest = -1e300
    for m in range(MEMBERS):
        foreseen = gained_at_once(table, t, OFFSETS[m], v.end_p1, v.end_p2, v.end_p3)
        variance = v.member_variance[m] + GAIN_DRIFT**2
        noise = GAIN_READING_ERROR**2 + (SLOPE_ERROR * lasted) ** 2 + (TABLE_ERROR * foreseen) ** 2
        surprise = gained - v.member_gain[m] * foreseen
        spread = foreseen**2 * variance + noise
        correction = variance * foreseen / spread
        corrected = v.member_gain[m] + correction * surprise
        v.member_gain[m] = min(max(corrected, LEAST_FACTOR), MOST_FACTOR)
        v.member_variance[m] = (1 - correction * foreseen) * variance
        log = math.log(v.probability[m]) - 0.5 * (surprise**2 / spread + math.log(spread))
        v.probability[m] = log  # until all are known
        largest = max(largest, log)
    for m in range(MEMBERS):
        v.probability[m] = math.exp(max(v.probability[m] - largest, -600.0))
    normalise(v)


@compiled
def learn_pace(v, table, t, p3, p3_change, period):
    """Correct the venting rate by the fall of ln p3 over the last period."""
    nominal = table.vent_rate[t] * period
    fall = math.log(max(p3 - p3_change, 0.1) / max(p3, 0.1))
    variance = v.pace_variance + PACE_DRIFT**2
    correction = variance / (variance + 2 * (PACE_READING_ERROR / nominal) ** 2)
    pace = v.pace + correction * (fall / nominal - v.pace)
    v.pace = min(max(pace, LEAST_FACTOR), MOST_FACTOR)
    v.pace_variance = (1 - correction) * variance


@compiled
def follow_p2(v, error, shut, period, filter_time):
    """Follow p2 - target [bar] and its slope while the valve is shut; otherwise keep the slope."""
    fading = math.exp(-period / filter_time)
    expected = v.error + v.slope * period
    surprise = error - expected
    if shut and v.was_shut > 0:
        v.error = expected + (1 - fading**2) * surprise
        v.slope += (1 - fading) ** 2 * surprise / period
    else:
        v.error = error
    v.was_shut = 1.0 if shut else 0.0


@compiled
def foresee(v, table, t, r, period):
    """What the learnt valve will do: times to open, rises of p2, reserve."""
    v.opens_in_early = time_to_open(table, t, v.early_offset, r.p1, r.p2, r.p3) / v.pace
    v.opens_from_rest = time_to_open(table, t, v.offset, r.p1, r.p2, r.p1) / v.pace
    v.forecast = v.error + v.fall * (v.opens_in + table.release_lag[t])
    later = r.p3 if v.on > 0 else r.p3 * math.exp(-table.vent_rate[t] * v.pace * period)
    v.under_way = v.gain * gained_at_once(table, t, v.offset, r.p1, r.p2, r.p3)
    v.after_period = v.gain * gained_at_once(table, t, v.offset, r.p1, r.p2, later)
    early = 0.0
    if time_to_open(table, t, v.early_offset, r.p1, r.p2, later) <= 0:
        early = gained_at_once(table, t, v.early_offset, r.p1, r.p2, later)
    v.after_period_early = (v.gain + 2 * v.gain_deviation) * early
    expected = table.hardest_fall[t] * (table.release_lag[t] + v.opens_from_rest)
    v.reserve = min(max(expected - TOLERATED, 0.0), MOST_RESERVE)


@compiled
def remember_breakdown(v, period):
    """Keep the largest shortfall below the target, and forget it slowly."""
    fed = v.head > LEAST_HEAD
    v.reached = 1.0 if fed and (v.reached > 0 or v.error > -REACHED) else 0.0
    shortfall = min(max(-v.error, 0.0), BAND_BAR) if v.reached > 0 else 0.0
    v.deepest = max(v.deepest * math.exp(-period / BREAKDOWN_MEMORY), shortfall)


@compiled
def follow_start(v, r, period):
    """Keep whether the first reading shows an empty control chamber, until the valve is shut."""
    if v.off_periods + v.on_periods == 0:
        v.found_open = 1.0 if r.p3 < EMPTY else 0.0
    elif (v.on_periods + 1) * period > SHUTTING - period / 2:
        v.found_open = 0.0


@compiled
def follow_coil(v, on):
    """Count the periods since the last switching; what was read when a pulse ended is kept."""
    if on and v.off_periods > 0:  # at the last reading
        v.end_p1, v.end_p2, v.end_p3, v.end_fall = v.p1, v.p2, v.p3, v.fall
        v.measuring = 1.0
    v.off_periods = 0.0 if on else v.off_periods + 1
    v.on_periods = v.on_periods + 1 if on else 0.0
    if not on:
        v.measuring = 0.0


@compiled
def learn(v, table, t, r, shut, period):
    """Correct what is known of a valve by its readings; shut: whether it is expected to be shut."""
    if shut and v.off_periods >= PERIODS_AFTER_RELEASE:
        learn_pace(v, table, t, r.p3, r.p3_change[0], period)
    if v.measuring > 0 and shut and v.on_periods > 1:
        lasted = v.on_periods * period
        learn_pulse(v, table, t, r.p2 - v.end_p2 - v.end_fall * lasted, lasted)
        summarise(v)
        v.measuring = 0.0


@compiled
def observe(
    v: Any, table: Any, t: int, r: Any, period: float, filter_time: float, informed: bool
) -> None:
    """Take in the readings of one valve.

    v: record of VALVE, changed. table: of the plants. t: the valve's plant in the table. r: record of
    epv_env.observation.READINGS. period: control period [s]. filter_time: time in which the weight of a
    reading of p2 fades by 1/e [s]. informed: whether the table is the valve's own, so that nothing is
    learnt of the valve.
    """
    if v.begun == 0:
        begin(v, informed)
    on = r.coil > 0.5
    follow_start(v, r, period)
    follow_coil(v, on)
    if v.off_periods > 1 and not informed:
        watch_opening(v, table, t, r.p1, r.p2, r.p3, r.p2_change[0] - min(v.slope, 0.0) * period)
        summarise(v)
    v.opens_in = time_to_open(table, t, v.offset, r.p1, r.p2, r.p3) / v.pace
    shut = v.opens_in > 0
    follow_p2(v, r.error, shut, period, filter_time)
    if not informed:
        learn(v, table, t, r, shut, period)
    v.on, v.p1, v.p2, v.p3, v.head = 1.0 if on else 0.0, r.p1, r.p2, r.p3, r.p1 - r.p2
    v.fall = min(v.slope, 0.0)
    v.pace_deviation = math.sqrt(v.pace_variance)
    foresee(v, table, t, r, period)
    remember_breakdown(v, period)
