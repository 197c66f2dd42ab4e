"""What people and programs get to see of an assessment."""

import json
from functools import cache

import numpy as np
import pytest

from identification.quality import figures as figures
from identification.quality.assessment import assess_recording
from identification.quality.section import (
    CORRELATIONS,
    STATISTICS,
    TREND_SLOPES,
    as_json,
    quality_section,
)
from identification.recordings.recording import CHANNELS
from identification.report.page import Picture, Section, Table
from tests.identification.quality.records import AMBIENT, rest_record, with_channel


@cache
def qualities():
    """A perfect record, and one with a channel that never changes."""
    stuck = with_channel(rest_record(1, 2000), "U", np.zeros(2000))
    return assess_recording(rest_record(0, 2000), AMBIENT), assess_recording(stuck, AMBIENT)


@pytest.mark.parametrize(("which", "report_2003"), [(0, True), (1, False)])
def test_a_section_is_complete(which, report_2003):
    section = quality_section(qualities()[which], report_2003=report_2003)
    assert [verdict.status for verdict in section.verdicts].count("good") == 5 - which
    assert sum(isinstance(block, Picture) for block in section.blocks) == 6
    for table in (block for block in section.blocks if isinstance(block, Table)):
        assert {len(row) for row in table.rows} == {len(table.columns)}


def cells_of(section: Section) -> set[str]:
    tables = (block for block in section.blocks if isinstance(block, Table))
    return {cell for table in tables for row in table.rows for cell in row}


def test_tables_show_the_report_s_figures_beside_their_own_if_asked():
    assert "  the report's" not in cells_of(quality_section(qualities()[0]))
    cells = cells_of(quality_section(qualities()[0], report_2003=True))
    for name in CHANNELS:
        assert f"{TREND_SLOPES[name]:.6f}" in cells
        assert f"{STATISTICS[name].kurtosis:.4f}" in cells
    for value in CORRELATIONS.values():
        assert f"{value:.4f}" in cells


@pytest.mark.parametrize("draw", figures.CAPTIONS)
def test_every_axis_has_a_unit_or_a_name(draw):
    figure = draw(qualities()[0])
    own = [axes.get_xlabel() + axes.get_ylabel() for axes in figure.axes]
    assert all(own) or figure.get_supxlabel()
    assert figure.get_supylabel() or all(axes.get_ylabel() for axes in figure.axes)


@pytest.mark.parametrize("which", [0, 1])
def test_json_is_strict_and_complete(which):
    content = json.loads(json.dumps(as_json(qualities()[which]), allow_nan=False))
    assert content["at_rest"] is True
    assert list(content["channels"]) == list(CHANNELS)
    assert len(content["correlations"]) == (10, 6)[which]
    assert content["channels"]["I"]["status"] == "good"
    assert (content["channels"]["U"]["statistics"]["kurtosis"] is None) == bool(which)
