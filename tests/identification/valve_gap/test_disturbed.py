"""Valves without any effect whose recordings are disturbed as on real benches: there is no gap."""

import pytest

from epv_env.plant.sensors import SENSORS
from identification.bench.disturbances import add_ripple, round_pressures
from identification.gap.rank.ranking import Ranking, rank_hypotheses
from identification.gap.rank.settings import RankingSettings
from identification.recordings.recording import Campaign
from identification.valve_gap.valve import Valve
from tests.identification.valve_gap.test_diagnose import campaign

pytestmark = pytest.mark.slow

RIPPLE = {name: 2.0 * SENSORS[name].noise for name in ("p2", "p3")}
"""Twice the sensors' noise."""


def ranked(disturbed: Campaign) -> Ranking:
    return rank_hypotheses(Valve(disturbed))


def test_pressures_in_steps_of_50_mbar_show_no_gap():
    assert ranked(round_pressures(campaign(), 0.05)).no_cause > RankingSettings().no_cause_doubt


@pytest.mark.xfail(strict=True, reason="three recordings have too few blocks of ten correlations")
def test_a_slow_ripple_on_the_pressures_is_no_gap():
    found = ranked(add_ripple(campaign(), sd=RIPPLE, correlation_time=0.02, seed=1))
    assert found.no_cause > RankingSettings().no_cause_doubt


def test_a_true_effect_is_found_in_pressures_of_50_mbar():
    found = ranked(round_pressures(campaign(G_eddy=4e-3), 0.05))
    assert found.inclusion["eddy_current"] > 0.9
