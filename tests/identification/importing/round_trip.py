"""A campaign of the virtual bench, and whether an imported one is the same."""

from functools import cache
from typing import Any

import numpy as np

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.importing.import_campaign import ImportedCampaign, read_files
from identification.recordings.campaign_files import write_campaign
from identification.recordings.recording import CHANNELS, Campaign


@cache
def bench() -> Campaign:
    """A test, the validation and the record at rest."""
    suite = (REPORT_SUITE[0], REPORT_SUITE[-2], REPORT_SUITE[-1])
    return run_bench(suite, Parameters.calibrated(), seed=11)


def assert_same_recordings(made: Campaign, true: Campaign) -> None:
    """Names, roles and periods are equal; pressures differ by 1 Pa at most, I and U by 1e-5 [A, V]."""
    for own, original in zip(made.recordings, true.recordings, strict=True):
        assert (own.name, own.role, own.period) == (original.name, original.role, original.period)
        for name in CHANNELS:
            atol = 1.0 if name.startswith("p") else 1e-5
            np.testing.assert_allclose(own.channel(name), original.channel(name), rtol=0, atol=atol)


def import_campaign(files, out, **options: Any) -> ImportedCampaign:
    """`read_files`, written as a campaign into the folder `out`."""
    imported = read_files(files, **options)
    write_campaign(imported.campaign, out, provenance=imported.provenance())
    return imported
