"""What people and programs get to see of an assessment."""

import json
from functools import cache

import numpy as np
import pytest

from identification.quality.assessment import assess_recording
from identification.quality.section import as_json, quality_section
from identification.recordings.recording import CHANNELS
from identification.report.page import Picture, Table
from tests.identification.quality.records import AMBIENT, rest_record, with_channel


@cache
def qualities():
    """A perfect record, and one with a channel that never changes."""
    stuck = with_channel(rest_record(1, 2000), "U", np.zeros(2000))
    return assess_recording(rest_record(0, 2000), AMBIENT), assess_recording(stuck, AMBIENT)


@pytest.mark.parametrize("which", [0, 1])
def test_section_and_json_are_complete(which):
    section = quality_section(qualities()[which])
    assert [verdict.status for verdict in section.verdicts].count("good") == 5 - which
    assert sum(isinstance(block, Picture) for block in section.blocks) == 1
    for table in (block for block in section.blocks if isinstance(block, Table)):
        assert {len(row) for row in table.rows} == {len(table.columns)}
    content = json.loads(json.dumps(as_json(qualities()[which]), allow_nan=False))
    assert content["at_rest"] is True
    assert list(content["channels"]) == list(CHANNELS)
    assert len(content["correlations"]) == (10, 6)[which]
    assert content["channels"]["I"]["status"] == "good"
    assert (content["channels"]["U"]["statistics"]["kurtosis"] is None) == bool(which)
