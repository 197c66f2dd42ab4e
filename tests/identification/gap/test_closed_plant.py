"""A simulator of which only inputs and outputs are known: no equations, states or regimes."""

from functools import cache

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.fit.gaps import WHOLE
from identification.gap.prepare import sensor_faults
from identification.gap.prepare.sensor_faults import reading_faults
from identification.gap.report.gap_json import as_json
from identification.gap.report.page import sections
from identification.report.page import Table


class ClosedTank(Tank):
    """A tank that gives levels for inflows and shows nothing else."""

    def __init__(self, **truth: float):
        super().__init__(virtual_recordings(truth))
        self.equations = ()

    def states(self, values, run):
        """None is known."""
        return {}

    def regimes(self, values, run):
        """None are told apart."""
        return {}

    def forced(self, values, run, forcing):
        """There is no equation to force."""
        raise AssertionError


@cache
def diagnosed() -> Diagnosis:
    return diagnose(ClosedTank(c=0.021, lag=5.0))


def test_sensors_and_clock_are_the_places_of_its_gap():
    found = diagnosed().localisation
    assert set(found.equation_probabilities) <= {"reading h", "timing"}
    assert found.likeliest.equation.name == "reading h"
    assert found.missing_term is None
    assert sum(found.equation_probabilities.values()) + found.nothing_missing == pytest.approx(1)


def test_the_whole_recording_is_its_regime():
    (gap,) = diagnosed().localisation.regime_gaps
    assert (gap.channel, gap.regime) == ("h", WHOLE)
    assert gap.gap > 2


def test_its_report_and_its_json_are_written():
    blocks = [block for section in sections(diagnosed()) for block in section.blocks]
    rows = [row for block in blocks if isinstance(block, Table) for row in block.rows]
    assert WHOLE.replace("_", " ") in [row[0] for row in rows]
    assert list(as_json(diagnosed())["where"]["equation"]) == ["reading h", "timing"]


def test_recordings_shorter_than_the_longest_delay_are_examined(monkeypatch):
    tank = ClosedTank()
    monkeypatch.setattr(sensor_faults, "DELAYS", (1, 300))
    for fault in reading_faults(tank, {"c": np.array([0.02])}, [0]):
        assert np.all(np.isfinite(fault.changes[0]))
