"""The report of a diagnosis: it says and shows what was found, of whatever plant."""

import re
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.block_bootstrap import Interval
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.judge.held_out import NOMINAL
from identification.gap.report.figures import location_figure
from identification.gap.report.gap_json import as_json
from identification.gap.report.page import calibrated_values, gap_table, sections
from identification.gap.report.quantities import probability_text
from identification.gap.report.sentences import (
    look_alikes,
    parameters_at_bounds,
    verdict_sentence,
)
from identification.report.page import Picture, Section, Table, Text
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
def test_every_report_has_the_same_parts(name):
    found = sections(diagnosed(name), NEXT, plan=[Text(text="The programmes.")])
    parts = ["Verdict", "Where the gap lies", "Which cause it is", "What remains"]
    assert [section.title for section in found] == [*parts, "Next recording"]
    assert all(section.blocks for section in found)
    assert not re.search(r"\b(nan|inf)\b", texts(found))
    assert plt.get_fignums() == []
    assert [section.title for section in sections(diagnosed(name))] == parts


@pytest.mark.parametrize("name", TANKS)
def test_the_first_screen_says_what_shows_it_and_says_what_next(name):
    first, *others = sections(diagnosed(name), NEXT)
    assert first.summary
    assert not any(section.summary for section in others)
    assert first.verdicts[-1].text == NEXT
    assert len(pictures(first)) == 1
    models = ["recalibrated", *(["with leak"] if name in ("known", "ambiguous") else [])]
    legend = pictures(first)[0].figure.axes[1].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()][: len(models)] == models


@pytest.mark.parametrize("name", TANKS)
def test_each_sentence_stands_once(name):
    said = [v.text for s in sections(diagnosed(name), NEXT) for v in s.verdicts]
    found = re.split(r"(?<=[.:;])\s+", " ".join(said))
    assert len(found) == len(set(found))


def test_a_known_cause_is_named_with_its_size_and_what_it_closes():
    status, text = verdict_sentence(diagnosed("known"), NEXT)
    cause = as_json(diagnosed("known"))["causes"][0]
    assert status == "good"
    probability = probability_text(cause["probability"])
    assert text.startswith(f"leak explains the gap ({probability}): adding it with leak = 0.00")
    assert f"closes {100 * cause['shrink']['fraction']:.0f} % (" in text
    assert "nothing predictable is left" in text


def test_no_gap_says_so_and_what_to_do():
    status, text = verdict_sentence(diagnosed("no_gap"), NEXT)
    assert status == "good"
    assert text.startswith("There is no gap beyond noise after recalibration")
    assert "add nothing" in text


def test_a_black_box_that_does_not_help_is_said_to():
    found = diagnosed("known")
    assert "itself is the floor" not in gap_table(found).caption
    useless = replace(found, reduction=replace(found.reduction, black_box_helps=False))
    assert gap_table(useless).caption.endswith("the recalibrated model itself is the floor.")


def test_an_unknown_cause_is_sent_to_the_place_and_the_shape():
    found = diagnosed("unknown")
    status, text = verdict_sentence(found, NEXT)
    assert status == "bad"
    unknown = probability_text(found.ranking.unknown)
    assert text.startswith(f"Nothing in the catalogue explains the gap ({unknown})")
    doubted = replace(found, ranking=replace(found.ranking, unknown=0.4))
    assert verdict_sentence(doubted, NEXT)[1].startswith("No cause in the catalogue is probable enough")
    component = max(
        found.conclusion.component_probabilities,
        key=found.conclusion.component_probabilities.__getitem__,
    )
    assert f"missing, most likely in {component}" in text
    assert found.localisation.missing_term is None or "see its shape" in text


def test_rivals_are_named_together_with_what_would_decide():
    status, text = verdict_sentence(diagnosed("ambiguous"), NEXT)
    assert status == "doubt"
    match = re.match(r"(leak|seep) \((\d+) %\) or (leak|seep) \((\d+) %\) explains the gap", text)
    assert match
    assert {match[1], match[3]} == {"leak", "seep"}
    assert match[2] == match[4]
    assert "cannot tell which" in text
    assert text.endswith(f"{NEXT}.")


def test_twins_are_announced_beside_their_correlation():
    found = diagnosed("ambiguous")
    named = {cause.effects[0]: look_alikes(found, cause) for cause in found.judged}
    assert named["leak"] == "seep (1.000)"
    assert named["seep"] == "leak (1.000)"
    assert named["lag"] == "-"
    assert look_alikes(diagnosed("known"), diagnosed("known").judged[0]) == "-"


def at_end(found: Diagnosis) -> Diagnosis:
    """The diagnosis with the leak as large as can be."""
    best, *others = found.judged
    estimate = best.hypothesis.estimate
    leak = estimate.hypothesis.parameters[0]
    vector = np.array([*estimate.vector[:-1], leak.high / leak.scale])
    changed = replace(best.hypothesis, estimate=replace(estimate, vector=vector))
    return replace(found, judged=[replace(best, hypothesis=changed), *others])


def test_a_size_at_an_end_of_its_range_is_a_warning():
    found = diagnosed("known")
    assert parameters_at_bounds(found) == []
    assert parameters_at_bounds(at_end(found)) == [
        "leak: leak is at an end of its physical range (0.0500 1/s)"
    ]
    assert [v.status for v in sections(at_end(found))[0].verdicts] == ["good", "doubt"]
    assert [v.status for v in sections(found)[0].verdicts] == ["good"]


def test_tables_hold_the_figures_of_the_file():
    found = diagnosed("known")
    content, shrink = as_json(found), sections(found)[3]
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


@pytest.fixture(scope="module")
def worded():
    return diagnose(WordedTank())


def test_people_read_words(worded):
    first, *others = sections(worded)
    verdict = " ".join(v.text for v in first.verdicts) + str(
        [b.rows for b in first.blocks if isinstance(b, Table)]
    )
    assert verdict.startswith(f"{NAMED_HOLE} explains the gap")
    assert "outflow at the valve (c)" in verdict
    assert "tank, balance of the water (" in texts(others)
    assert NAMED_HOLE in [row[0] for row in table(others[-1], "Model").rows]


def test_programs_read_names(worded):
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
    assert found.kept is found.nominal
    assert "model to use: nominal, without a cause" in calibrated_values(found, "good").caption


def test_the_figure_of_a_full_bar_stays_within_the_frame():
    figure = location_figure(diagnosed("known"))
    figure.draw_without_rendering()
    labels = [(text, axes) for axes in figure.axes for text in axes.texts]
    assert "> 99 %" in {text.get_text() for text, _ in labels}
    assert all(text.get_window_extent().x1 < axes.bbox.x1 for text, axes in labels)
