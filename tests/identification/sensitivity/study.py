"""One run of Tables 8 and 9 for all tests."""

from functools import cache

from identification.sensitivity.sensitivity_study import OneAtATime, run_one_at_a_time


@cache
def one_at_a_time() -> OneAtATime:
    return run_one_at_a_time()
