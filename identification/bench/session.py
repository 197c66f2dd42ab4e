"""A whole session on the virtual bench: a suite of programmes run and measured."""

from collections.abc import Sequence

from epv_env.common.progress import progress
from epv_env.plant.parameters import Parameters
from identification.bench.measurement import measured_campaign, run_programme
from identification.bench.programmes import Programme
from identification.recordings.recording import Campaign
from identification.report_2003.cases import SAMPLING_RATE

SLOWEST, FASTEST = 500.0, 20_000.0
"""Sampling rates of the bench [1/s]."""


def run_bench(
    suite: Sequence[Programme], truth: Parameters, *, seed: int, rate: float = SAMPLING_RATE
) -> Campaign:
    """Run and measure every programme on a plant with the true parameters.

    Raises ValueError for a rate that the bench does not have.
    """
    if not SLOWEST <= rate <= FASTEST:
        raise ValueError(
            f"sampling rate {rate:g} 1/s is outside {SLOWEST:g} to {FASTEST:g}: choose one inside"
        )
    truths = [
        run_programme(truth, programme, rate=rate)
        for programme in progress(suite, what="bench: recordings", total=len(suite))
    ]
    return measured_campaign(truths, truth, seed=seed)
