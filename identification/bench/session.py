"""A whole session on the virtual bench: a suite of programmes run and measured."""

from collections.abc import Sequence

from epv_env.common.progress import progress
from epv_env.plant.parameters import Parameters
from identification.bench.measurement import measured_campaign, run_programme
from identification.bench.programmes import Programme
from identification.bench.settings import BENCH, BenchSettings
from identification.recordings.recording import Campaign
from identification.recordings.rules import RULES, RecordingRules
from identification.report_2003.cases import SAMPLING_RATE


def run_bench(
    suite: Sequence[Programme],
    truth: Parameters,
    *,
    seed: int,
    rate: float = SAMPLING_RATE,
    rules: RecordingRules = RULES,
    settings: BenchSettings = BENCH,
) -> Campaign:
    """Run and measure every programme on a plant with the true parameters.

    rate: samples per second [1/s]. seed: of the sensors' noise. rules: by which the recordings are read,
    with the bench's sensors. Raises ValueError for a rate that the
    bench does not have.
    """
    least, greatest = settings.least_rate, settings.greatest_rate
    if not least <= rate <= greatest:
        raise ValueError(
            f"sampling rate {rate:g} 1/s is outside {least:g} to {greatest:g}: choose one inside"
        )
    truths = [
        run_programme(truth, programme, rate=rate, settings=settings)
        for programme in progress(suite, what="bench: recordings", total=len(suite))
    ]
    return measured_campaign(truths, truth, seed=seed, rules=rules)
