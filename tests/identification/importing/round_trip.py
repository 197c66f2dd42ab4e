"""Whether an imported campaign is the one that the files were made from."""

from typing import Any

import numpy as np

from identification.importing.import_campaign import ImportedCampaign, read_files
from identification.recordings.campaign_files import write_campaign
from identification.recordings.recording import CHANNELS, Campaign


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
