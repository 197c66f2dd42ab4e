"""Few causes under few conditions, simulated once for all tests."""

from functools import cache

import numpy as np

from identification.studies.error_tables.bench_conditions import drawn_condition_sets
from identification.studies.error_tables.candidates import Candidate, candidates
from identification.studies.error_tables.error_prediction import predicted_errors
from identification.studies.error_tables.predicted_tables import (
    PredictedTables,
    refined_tables,
    simulated_tables,
)

CAUSES = ("command_delay", "flyback_voltage", "circuit_leak", "parameter:d1")


@cache
def coarse() -> PredictedTables:
    return simulated_tables(candidates(CAUSES), drawn_condition_sets(3, seed=7), "test")


@cache
def refined() -> PredictedTables:
    return refined_tables(coarse())


def table(**changes: float) -> np.ndarray:
    """Tables 13 and 15 of a valve under conditions that no predicted table has [%], (5, 3)."""
    unseen = drawn_condition_sets(2, seed=99)[1]
    valve = Candidate(cause="", changes=changes).valve(unseen)
    return predicted_errors(unseen, [valve]).calibrated[0]
