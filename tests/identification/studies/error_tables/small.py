"""Few causes under few conditions, simulated once for all tests."""

from functools import cache

import numpy as np

from identification.studies.error_tables.candidates import Candidate, candidates
from identification.studies.error_tables.patterns import predicted
from identification.studies.error_tables.predicted_tables import Library, drawn, refined, simulated

CAUSES = ("command_delay", "flyback_voltage", "circuit_leak", "parameter:d1")


@cache
def coarse() -> Library:
    return simulated(candidates(CAUSES), drawn(3, seed=7), "test")


@cache
def library() -> Library:
    return refined(coarse())


def table(**changes: float) -> np.ndarray:
    """Tables 13 and 15 of a valve under conditions that the library does not hold."""
    unseen = drawn(2, seed=99)[1]
    return predicted(unseen, [Candidate(cause="", changes=changes).valve(unseen)]).after[0]
