"""Tables whose causes are known are traced back to them, and others to none."""

import numpy as np
import pytest

from identification.studies.error_tables.candidates import NONE, Candidate
from identification.studies.error_tables.error_table_study import real_bench
from identification.studies.error_tables.pairs import all_misfits, nearest, probabilities, summed, usable
from identification.studies.error_tables.patterns import printed_after
from identification.studies.error_tables.predicted_tables import simulated
from identification.studies.error_tables.ranking import (
    CANNOT,
    CURRENT,
    GIVES,
    inseparable,
    matches,
    misfits,
)
from identification.studies.error_tables.ranking_reliability import smallest_set, trust
from tests.identification.studies.error_tables.small import CAUSES, coarse, library, table


@pytest.mark.parametrize(
    ("cause", "changes"),
    [
        ("flyback_voltage", {"U_clamp": 20.0}),
        ("command_delay", {"t_delay": 2.1e-3}),
        ("circuit_leak", {"A_circuit": 4e-7}),
        (NONE, {}),
    ],
)
def test_a_known_cause_comes_first_under_conditions_that_are_not_known(cause, changes):
    found = matches(library(), table(**changes))
    assert found[0].cause == cause
    assert found[0].verdict == GIVES
    assert inseparable(found) == [cause]


def test_a_table_that_nothing_gives_is_given_by_nothing():
    """The verdicts can fail: ten times the printed error of the current is out of reach."""
    absurd = printed_after() * np.array([1.0, 1.0, 10.0])
    found = matches(library(), absurd)
    assert all(match.verdict != GIVES and match.current > 1.75 for match in found)


def test_the_printed_table_is_not_noise_and_the_delay_gives_its_current_only():
    verdicts = {match.cause: match.verdict for match in matches(library(), printed_after())}
    assert verdicts[NONE] == CANNOT
    assert verdicts["command_delay"] == CURRENT


def test_a_size_between_two_is_near_what_it_gives_when_simulated():
    middle = next(c for c in library().candidates if 1.7e-3 < c.changes.get("t_delay", 0) < 1.8e-3)
    column = library().candidates.index(middle)
    exact = simulated([middle], library().conditions, "test").after[:, 0]
    assert library().after[:, column] == pytest.approx(exact, rel=0.15)


def test_errors_of_two_causes_add_in_squares():
    changes: dict[str, float] = {"U_clamp": 20.0, "A_circuit": 4e-7}
    alone = [table(**{symbol: size}) for symbol, size in changes.items()]
    excess, floor = summed(np.stack([table(), *alone]))
    both = np.sqrt(excess.sum(axis=0) + floor).reshape(alone[0].shape)
    assert np.exp(misfits(table(**changes)[None, None], both)) < 1.25


def test_a_known_pair_is_the_most_probable():
    halves = usable(coarse())
    misfit = all_misfits(halves, table(U_clamp=30.0, A_circuit=5e-7))
    probability = probabilities(halves, misfit, width=0.1)
    assert {halves.causes[i] for i in np.argsort(-probability)[:2]} == {
        "flyback_voltage",
        "circuit_leak",
    }
    assert probability.sum() == pytest.approx(2.0)
    partner = nearest(halves, misfit)[halves.causes.index("flyback_voltage")].argmin()
    assert halves.causes[partner] == "circuit_leak"


def test_clear_tables_are_traced_more_often_than_scattered_ones():
    clear, scattered = (trust(usable(coarse()), s, n=30, seed=0) for s in (0.02, 1.0))
    assert clear.first > 0.9
    assert scattered.first < clear.first


def test_smallest_set_holds_what_it_promises():
    assert smallest_set(np.array([0.1, 1.2, 0.7])) == [1, 2]
    assert smallest_set(np.array([0.95, 0.05])) == [0]


def test_the_command_writes_its_files_and_the_same_for_the_same_seed(tmp_path):
    for name, images in (("first", tmp_path / "first"), ("again", None)):
        real_bench(tmp_path / name, seed=1, images=images, draws=2, causes=CAUSES[:3])
    names = {path.name for path in (tmp_path / "first").iterdir()}
    assert names == {"tables.json", "tables.html", "real-bench.png"}
    first, again = ((tmp_path / name / "tables.json").read_bytes() for name in ("first", "again"))
    assert first == again


def test_sizes_read_with_their_units():
    assert (
        Candidate(cause="", changes={"U_clamp": 30.0, "S_PV": 0.5}).size == "U_clamp = 30 V, S_PV = 0.5"
    )
    assert Candidate(cause="", warmth=5.0, lag=1e-3).size == "±5 K, 1 ms"
