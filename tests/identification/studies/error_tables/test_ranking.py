"""Tables whose causes are known are traced back to them, and others to none."""

import numpy as np
import pytest

from identification.studies.error_tables.candidates import NO_CAUSE, Candidate
from identification.studies.error_tables.error_prediction import printed_calibrated_errors
from identification.studies.error_tables.error_table_study import error_table_study
from identification.studies.error_tables.pairs import (
    candidate_pair_misfits,
    cause_pair_misfits,
    cause_probabilities,
    excess_squares,
    pair_members,
)
from identification.studies.error_tables.predicted_tables import simulated_tables
from identification.studies.error_tables.ranking import (
    EXPLAINS_ALL,
    EXPLAINS_CURRENT,
    EXPLAINS_NOTHING,
    inseparable_causes,
    ranked_causes,
    table_misfits,
)
from identification.studies.error_tables.ranking_reliability import ranking_reliability, smallest_set
from identification.studies.error_tables.settings import ErrorTableSettings
from tests.identification.studies.error_tables.small import CAUSES, coarse, refined, table


@pytest.mark.parametrize(
    ("cause", "changes"),
    [
        ("flyback_voltage", {"U_clamp": 20.0}),
        ("command_delay", {"t_delay": 2.1e-3}),
        ("circuit_leak", {"A_circuit": 4e-7}),
        (NO_CAUSE, {}),
    ],
)
def test_a_known_cause_comes_first_under_conditions_that_are_not_known(cause, changes):
    found = ranked_causes(refined(), table(**changes))
    assert found[0].cause == cause
    assert found[0].verdict == EXPLAINS_ALL
    assert inseparable_causes(found) == [cause]


def test_a_table_that_nothing_gives_is_given_by_nothing():
    """The verdicts can fail: ten times the printed error of the current is out of reach."""
    absurd = printed_calibrated_errors() * np.array([1.0, 1.0, 10.0])
    found = ranked_causes(refined(), absurd)
    assert all(match.verdict != EXPLAINS_ALL and match.current_factor > 1.75 for match in found)


def test_the_printed_table_is_not_noise_and_the_delay_gives_its_current_only():
    verdicts = {
        match.cause: match.verdict for match in ranked_causes(refined(), printed_calibrated_errors())
    }
    assert verdicts[NO_CAUSE] == EXPLAINS_NOTHING
    assert verdicts["command_delay"] == EXPLAINS_CURRENT


def test_a_size_between_two_is_near_what_it_gives_when_simulated():
    middle = next(c for c in refined().candidates if 1.7e-3 < c.changes.get("t_delay", 0) < 1.8e-3)
    column = refined().candidates.index(middle)
    exact = simulated_tables([middle], refined().conditions, "test").calibrated[:, 0]
    assert refined().calibrated[:, column] == pytest.approx(exact, rel=0.15)


def test_errors_of_two_causes_add_in_squares():
    changes: dict[str, float] = {"U_clamp": 20.0, "A_circuit": 4e-7}
    alone = [table(**{symbol: size}) for symbol, size in changes.items()]
    excess, floor = excess_squares(np.stack([table(), *alone]))
    both = np.sqrt(excess.sum(axis=0) + floor).reshape(alone[0].shape)
    assert np.exp(table_misfits(table(**changes)[None, None], both)) < 1.25


def test_a_known_pair_is_the_most_probable():
    members = pair_members(coarse())
    misfit = candidate_pair_misfits(members, table(U_clamp=30.0, A_circuit=5e-7))
    probability = cause_probabilities(members, misfit, kernel_width=0.1)
    assert {members.causes[i] for i in np.argsort(-probability)[:2]} == {
        "flyback_voltage",
        "circuit_leak",
    }
    assert probability.sum() == pytest.approx(2.0)
    partner = cause_pair_misfits(members, misfit)[members.causes.index("flyback_voltage")].argmin()
    assert members.causes[partner] == "circuit_leak"


def test_clear_tables_are_traced_more_often_than_scattered_ones():
    clear, scattered = (
        ranking_reliability(pair_members(coarse()), s, n=30, seed=0) for s in (0.02, 1.0)
    )
    assert clear.current_cause_first > 0.9
    assert scattered.current_cause_first < clear.current_cause_first


def test_the_smallest_set_holds_the_probability():
    assert smallest_set(np.array([0.1, 1.2, 0.7])) == [1, 2]
    assert smallest_set(np.array([0.95, 0.05])) == [0]


def test_the_command_writes_its_files_and_the_same_for_the_same_seed(tmp_path):
    settings = ErrorTableSettings(draws=2)
    for name, images in (("first", tmp_path / "first"), ("again", None)):
        error_table_study(tmp_path / name, seed=1, images=images, causes=CAUSES[:3], settings=settings)
    names = {path.name for path in (tmp_path / "first").iterdir()}
    assert names == {"tables.json", "tables.html", "real-bench.png"}
    first, again = ((tmp_path / name / "tables.json").read_bytes() for name in ("first", "again"))
    assert first == again


def test_sizes_read_with_their_units():
    assert (
        Candidate(cause="", changes={"U_clamp": 30.0, "S_PV": 0.5}).size == "U_clamp = 30 V, S_PV = 0.5"
    )
    assert Candidate(cause="", winding_deviation=5.0, current_lag=1e-3).size == "±5 K, 1 ms"
