"""What remains beside named causes: verdict partial, advice by held-out benefit, disturbances."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.block_bootstrap import Interval
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.fit.evidence import variance_inflation
from identification.gap.judge.verdict import NO_GAP, PARTIAL, UNKNOWN
from identification.gap.report.gap_json import (
    GAP,
    SYSTEMATIC_FORM_ERROR,
    TERM,
    as_json,
    parameter_covariance,
    term_table,
    write_results,
)
from identification.gap.report.sentences import verdict_sentence
from tests.identification.gap.tanks import TANKS, diagnosed


@cache
def leaking_and_disturbed() -> Diagnosis:
    """A leak, and beside it something that no cause of the catalogue makes."""
    tank = Tank(virtual_recordings({"c": 0.021, "leak": 4e-3}))
    for run in tank.runs:
        run.measured[:] += 0.006 * np.sin(run.time / 3.0)
    return diagnose(tank)


def partial() -> Diagnosis:
    """The same, with what a judge has to say of it set by hand: no test of the judge."""
    found = leaking_and_disturbed()
    first = next(c for c in found.judged if c.effects == ("leak",))
    conclusion = replace(found.conclusion, verdict=PARTIAL, ambiguity_set=[first])
    return replace(found, conclusion=conclusion, judged=[first], remaining=found.localisation)


def unknown() -> Diagnosis:
    """The same where the leak is not believed to be the cause."""
    found = partial()
    conclusion = replace(found.conclusion, verdict=UNKNOWN, ambiguity_set=[])
    return replace(found, conclusion=conclusion)


def closing(found: Diagnosis, low: float, value: float, high: float) -> Diagnosis:
    """The diagnosis with another share closed by its first cause."""
    label = found.judged[0].hypothesis.label
    shares = {**found.reduction.shares_closed, label: Interval(value=value, low=low, high=high)}
    left = replace(found.reduction.unexplained, fraction=1.0 - value)
    return replace(found, reduction=replace(found.reduction, shares_closed=shares, unexplained=left))


def test_a_leak_beside_a_disturbance_is_named_and_to_be_added():
    found = leaking_and_disturbed()
    assert found.conclusion.verdict == PARTIAL
    assert found.helps
    assert "leak" in found.model.names
    assert verdict_sentence(found)[0] == "doubt"
    assert "Add it with leak =" in verdict_sentence(found)[1]
    content = json.loads(json.dumps(as_json(found), allow_nan=False))
    assert content["causes"][0]["effects"] == ["leak"]
    assert 0.0 < content["left"]["fraction"] < 0.5


def test_the_remainder_is_what_the_named_causes_do_not_close():
    left = as_json(closing(partial(), 0.70, 0.76, 0.81))["left"]
    assert left["fraction"] == pytest.approx(0.24)
    assert (left["low"], left["high"]) == (pytest.approx(0.19), pytest.approx(0.30))
    equation, component = left["equation"], left["component"]
    assert sum(component.values()) == pytest.approx(sum(equation.values()))
    assert sum(equation.values()) <= 1.0 + 1e-9
    assert as_json(unknown())["left"]["fraction"] == 1.0


def test_partial_says_what_to_add_what_it_closes_and_what_remains():
    status, text = verdict_sentence(closing(partial(), 0.70, 0.76, 0.81))
    assert status == "doubt"
    assert text.startswith(
        "leak closes 76 % (70 to 81 %) of the gap on recordings never fitted to; that "
    )
    assert "this is the cause has a probability of" in text
    assert "Add it with leak = " in text
    assert "24 % (19 to 30 %) of the gap remains, most likely in f1 of tank (" in text


@pytest.mark.parametrize(
    ("of", "closed", "said", "unsaid"),
    [
        (partial, (0.0, 0.1, 0.3), "do not add", "Add it"),
        (unknown, (0.0, 0.1, 0.3), "do not add", "Add leak"),
        (unknown, (0.3, 0.44, 0.48), "closes 44 % (30 to 48 %) of the gap", "Add leak"),
        (unknown, (0.7, 0.74, 0.8), "Add leak all the same: it closes 74 % (70 to", "do not add"),
    ],
)
def test_advice_follows_what_a_cause_surely_closes_whether_its_name_is_sure_or_not(
    of, closed, said, unsaid
):
    text = verdict_sentence(closing(of(), *closed))[1]
    assert said in text
    assert unsaid not in text


@pytest.mark.parametrize("verdict", [*TANKS])
def test_no_word_reassures_while_the_gap_stands_far_above_the_noise(verdict):
    found = diagnosed(verdict)
    large = Interval(value=40.0, low=30.0, high=50.0)
    gaps = {label: replace(gap, overall=large) for label, gap in found.reduction.gaps.items()}
    status, text = verdict_sentence(replace(found, reduction=replace(found.reduction, gaps=gaps)))
    assert status != "good"
    assert not any(word in text for word in ("no gap", "small gap", "nothing predictable is left"))


def with_disturbance(found: Diagnosis, sd: float) -> Diagnosis:
    """No gap, with a disturbance [noise deviations] that is correlated over 20 ms."""
    seen = [replace(own, sd=sd, time_scale=0.02) for own in found.ranking.noise]
    conclusion = replace(found.conclusion, verdict=NO_GAP, ambiguity_set=[])
    ranking = replace(found.ranking, noise=seen, no_cause=0.99)
    return replace(found, conclusion=conclusion, ranking=ranking, remaining=None)


def test_no_gap_says_what_a_disturbance_is_in_the_channel_s_unit():
    found = partial()
    channel = found.ranking.problem.plant.channels[0]
    assert channel.noise is not None
    text = verdict_sentence(with_disturbance(found, 2.0))[1]
    size = 2.0 * channel.noise / channel.scale
    assert f"a disturbance of {size:#.3g} mm in h, correlated over 20.0 ms" in text
    assert "no model input explains" in text
    assert "add nothing" in text
    assert "disturbance" not in verdict_sentence(with_disturbance(found, 0.05))[1]
    content = as_json(with_disturbance(found, 2.0))["discrepancy"][channel.name]
    assert content == {"sd": pytest.approx(1e3 * 2.0 * channel.noise), "time_scale_s": 0.02}


def test_the_missing_term_is_a_file_beside_the_answer(tmp_path):
    found = partial()
    term = found.localisation.missing_term
    assert term is not None
    shown = replace(
        found, remaining=replace(found.localisation, missing_term=replace(term, explained=0.9))
    )
    content = write_results(shown, tmp_path)
    assert json.loads((tmp_path / GAP).read_text(encoding="utf-8")) == content
    assert content["left"]["term"] == TERM
    table = json.loads((tmp_path / TERM).read_text(encoding="utf-8"))
    assert table == term_table(replace(term, explained=0.9))
    assert table["state"] in ("h", "q")
    columns = table["columns"]
    assert columns["state"] == sorted(columns["state"])
    assert {len(column) for column in columns.values()} == {len(term.x)}
    assert write_results(replace(found, remaining=None), tmp_path)["left"]["term"] is None
    assert not (tmp_path / TERM).exists(), "of an earlier diagnosis"


def test_an_interval_is_as_wide_as_what_remains_is_large_and_correlated():
    """Errors of the cause's form count once: no correlation of residuals makes them larger."""
    found = partial()
    hypothesis = found.judged[0].hypothesis
    covariance = parameter_covariance(found, hypothesis)
    inflation = variance_inflation(hypothesis, found.ranking.noise)
    assert inflation > 10
    form = covariance - inflation * hypothesis.covariance
    size = hypothesis.estimate.hypothesis.parameters[0]
    acting = hypothesis.estimate.vector[hypothesis.estimate.cause_start] * size.scale
    share = SYSTEMATIC_FORM_ERROR
    np.testing.assert_allclose(np.diag(form), [0.0, (share * acting) ** 2], atol=1e-12)
