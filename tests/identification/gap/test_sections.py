"""The report of a diagnosis: it says and shows what was found, of whatever plant."""

import re
from dataclasses import replace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.block_bootstrap import Interval
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.judge.held_out import NOMINAL
from identification.gap.report.figures import comparison_figure
from identification.gap.report.gap_json import as_json
from identification.gap.report.page import calibrated_values, ranking_table, sections
from identification.gap.report.sentences import (
    look_alikes,
    parameters_at_bounds,
    probability_text,
    verdict_sentence,
    words_of,
)
from identification.gap.search.onset import Onset
from identification.report.page import Picture, Section, Table
from tests.identification.gap.tanks import TANKS, diagnosed

NEXT = "Record a long draining"


def pictures(section: Section) -> list[Picture]:
    return [block for block in section.blocks if isinstance(block, Picture)]


def table(section: Section, first: str) -> Table:
    (found,) = [b for b in section.blocks if isinstance(b, Table) and b.columns[0] == first]
    return found


def texts(found: list[Section]) -> str:
    return " ".join(verdict.text for section in found for verdict in section.verdicts)


@pytest.mark.parametrize("name", TANKS)
def test_one_screen_says_what_shows_it_and_says_what_next_and_all_else_is_folded(name):
    first, *others = sections(diagnosed(name), NEXT, plan=["The programmes."])
    assert (first.title, first.summary, first.verdicts[-1].text) == ("Verdict", True, NEXT)
    assert len(first.blocks) == len(pictures(first)) == 1
    assert not any(section.summary for section in others)
    assert all(section.blocks for section in others)
    places = [] if name == "no_gap" else ["Where the gap lies"]
    assert [section.title for section in others] == [
        "Values to use", "How large the gap is", *places, "Which causes were weighed", "Next recording",
    ]  # fmt: skip
    assert sum(len(pictures(section)) for section in others) == (name == "unknown")
    assert not re.search(r"\b(nan|inf)\b", texts([first, *others]))
    sentences = re.split(r"(?<=[.:;])\s+", texts([first, *others]))
    assert len(sentences) == len(set(sentences))
    assert plt.get_fignums() == []


@pytest.mark.parametrize(
    ("name", "models"),
    [
        ("known", ["before: recalibrated", "after: with the likeliest cause"]),
        ("no_gap", ["before: nominal parameters", "after: recalibrated"]),
    ],
)
def test_the_picture_shows_readings_and_both_models(name, models):
    found = diagnosed(name)
    above, below = comparison_figure(found).axes
    assert [line.get_label() for line in above.lines] == ["measured", *models]
    (run,) = (run for run in found.ranking.problem.plant.runs if run.held_out)
    measured, before, after = (np.asarray(line.get_ydata()) for line in above.lines)
    np.testing.assert_allclose(measured, 1e3 * run.measured[0])
    assert np.std(measured - after) < 0.2 * np.std(measured - before)
    for model, error in zip((before, after), below.lines, strict=True):
        np.testing.assert_allclose(measured - model, np.asarray(error.get_ydata()), atol=1e-9)


@pytest.mark.parametrize("name", TANKS)
def test_a_doubt_has_a_reason_and_causes_that_hardly_may_act_have_no_line(name):
    words = words_of(diagnosed(name))
    assert bool(words.doubts) == (words.status == "doubt")
    warned = words_of(replace(diagnosed(name), warnings=["h of test_1 is clipped"]))
    assert warned.doubts[-1] == "h of test_1 is clipped."
    assert warned.status == ("bad" if name == "unknown" else "doubt")
    rows = ranking_table(diagnosed(name)).rows
    assert any(row[1] != "< 1 %" for row in rows)
    assert all(row[0] == "lag" for row in rows if row[1] == "< 1 %"), "the nearest, if any"


def test_a_known_cause_is_named_with_its_size_and_what_it_closes():
    status, text = verdict_sentence(diagnosed("known"))
    cause = as_json(diagnosed("known"))["causes"][0]
    assert status == "good"
    probability = probability_text(cause["probability"])
    assert text.startswith(f"leak explains the gap ({probability}): adding it with leak = 0.00")
    assert f"closes {100 * cause['shrink']['fraction']:.0f} % (" in text
    assert "nothing predictable is left" in text


def test_an_unknown_cause_is_sent_to_the_place_and_the_shape():
    found = diagnosed("unknown")
    status, text = verdict_sentence(found)
    assert status == "bad"
    unknown = probability_text(found.ranking.unknown)
    assert text.startswith(f"Nothing in the catalogue explains the gap ({unknown})")
    doubted = replace(found, ranking=replace(found.ranking, unknown=0.4))
    assert verdict_sentence(doubted)[1].startswith("No cause in the catalogue is probable enough")
    component = max(
        found.conclusion.component_probabilities,
        key=found.conclusion.component_probabilities.__getitem__,
    )
    assert f"missing, most likely in {component}" in text
    assert found.localisation.missing_term is None or "see its shape" in text


def test_rivals_are_named_together_with_what_would_decide():
    found = diagnosed("ambiguous")
    status, text = verdict_sentence(found)
    assert status == "doubt"
    match = re.match(r"(leak|seep) \((\d+) %\) or (leak|seep) \((\d+) %\) explains the gap", text)
    assert match
    assert {match[1], match[3]} == {"leak", "seep"}
    assert match[2] == match[4]
    assert text.endswith("These recordings cannot tell which of them acts.")
    named = {cause.effects[0]: look_alikes(found, cause) for cause in found.judged}
    assert named == {"leak": "seep (1.000)", "seep": "leak (1.000)"} | dict.fromkeys(
        named.keys() - {"leak", "seep"}, "-"
    )


def at_end(found: Diagnosis, end: str = "high", **changes: Any) -> Diagnosis:
    """The diagnosis with the leak at an end of its range. changes: of the leak's parameter."""
    best, *others = found.conclusion.ambiguity_set
    estimate = best.hypothesis.estimate
    leak = replace(estimate.hypothesis.parameters[0], **changes)
    (cause,) = estimate.hypothesis.causes
    hypothesis = replace(estimate.hypothesis, causes=(replace(cause, parameters=(leak,)),))
    estimate = replace(estimate, hypothesis=hypothesis)
    vector = np.array([*estimate.vector[:-1], getattr(leak, end) / leak.scale])
    changed = replace(best.hypothesis, estimate=replace(estimate, vector=vector))
    conclusion = replace(found.conclusion, ambiguity_set=[replace(best, hypothesis=changed), *others])
    return replace(found, conclusion=conclusion)


def test_a_size_at_an_end_of_its_range_is_a_warning():
    found = diagnosed("known")
    assert parameters_at_bounds(found) == []
    assert parameters_at_bounds(at_end(found)) == [
        "leak: leak is at an end of its physical range (0.0500 1/s)"
    ]
    assert parameters_at_bounds(at_end(found, "low")) == [], "no leak at all says nothing"
    assert parameters_at_bounds(at_end(found, "low", trials=())) == [], "nor does the usual form"
    assert [v.status for v in sections(at_end(found))[0].verdicts] == ["doubt", "why"]
    assert [v.status for v in sections(found)[0].verdicts] == ["good"]


def test_an_onset_is_the_interval_of_its_drives():
    def said(*args):
        return words_of(replace(diagnosed("known"), onsets={"leak": Onset(*args)})).what

    unsure = said("d-7", 0.33, None, "d-4", "d-9")
    assert "It acts from a drive between d-4 and d-9 on (95 %), most likely d-7 (33 %)." in unsure
    assert "It acts from d-5 on (98 %), until d-6, in which" in said("d-5", 0.98, "d-6", "d-5", "d-5")


def test_tables_hold_the_figures_of_the_file():
    found = diagnosed("known")
    content, shrink = as_json(found), sections(found)[2]
    gaps = {row[0]: row for row in table(shrink, "Model").rows}
    assert gaps["recalibrated"][1].startswith(f"{content['gap']['recalibrated']:.1f} (")
    assert gaps["leak"][1].startswith(f"{content['gap']['with_cause']:.2f} (")
    assert gaps["black box"][-1] == "-"
    columns = table(shrink, "Model").columns
    percent = content["gap"]["report_metric_percent"]["nominal"]
    assert gaps["nominal"][columns.index("overall [%]")] == f"{percent:.2f}"


HOLE, NAMED_HOLE = "hole in the wall", "hole in the wall (leak)"


class WordedTank(Tank):
    """A leaking tank whose causes, parameters and equations have words."""

    def __init__(self):
        super().__init__(virtual_recordings({"c": 0.021, "leak": 4e-3}))
        self.causes = tuple(
            replace(cause, words=HOLE) if cause.name == "leak" else cause for cause in self.causes
        )
        self.parameters = tuple(replace(p, meaning="outflow at the valve") for p in self.parameters)
        self.equations = tuple(replace(e, meaning="balance of the water") for e in self.equations)


def test_people_read_words_and_programs_names():
    worded = diagnose(WordedTank())
    first, values, gap, where, _ = sections(worded)
    assert first.verdicts[0].text.startswith(f"{NAMED_HOLE} explains the gap")
    assert "outflow at the valve (c)" in [row[0] for row in table(values, "Parameter").rows]
    assert "tank, balance of the water (" in where.verdicts[0].text
    assert NAMED_HOLE in [row[0] for row in table(gap, "Model").rows]
    content = as_json(worded)
    assert content["ambiguity_set"] == [["leak"]]
    assert HOLE not in str(content)


@pytest.mark.parametrize(
    ("verdict", "model"),
    [("known", "with leak"), ("no_gap", "recalibrated"), ("unknown", "recalibrated")],
)
def test_the_values_are_those_of_the_model_to_use(verdict, model):
    table = calibrated_values(diagnosed(verdict), "good")
    assert f"model to use: {model}" in table.caption
    symbols = [p.title for p in diagnosed(verdict).ranking.problem.plant.parameters]
    assert [row[0] for row in table.rows] == symbols
    assert {row[-1] for row in table.rows} == {"yes"}


def test_a_nominal_model_is_not_called_recalibrated():
    found = diagnosed("no_gap")
    gaps = found.reduction.gaps
    better = replace(gaps[NOMINAL], overall=Interval(value=0.5, low=0.5, high=0.5))
    reduction = replace(found.reduction, gaps={**gaps, NOMINAL: better})
    found = replace(found, reduction=reduction)
    assert found.model is found.nominal
    assert "model to use: nominal, without a cause" in calibrated_values(found, "good").caption
