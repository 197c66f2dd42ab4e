"""Pages say in words what files name by symbols, and whether to trust the calibrated values."""

from dataclasses import replace

import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import diagnose
from identification.gap.gap_json import as_json
from identification.gap.report_page import calibrated_values, sections
from identification.gap.sentences import in_words
from identification.report.page import Section, Table, Text
from tests.identification.gap.tanks import diagnosed

HOLE = "a hole in the wall"


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


def written(section: Section) -> str:
    """All text of a section but what stands in its figures."""
    texts = [verdict.text for verdict in section.verdicts]
    for block in section.blocks:
        if isinstance(block, Text):
            texts.append(block.text)
        else:
            texts.append(block.caption)
        if isinstance(block, Table):
            texts += [cell for row in block.rows for cell in row]
    return "\n".join(texts)


def test_people_read_words(worded):
    verdict, *others = map(written, sections(worded))
    assert verdict.startswith(f"{HOLE} explains the gap")
    assert "outflow at the valve (c)" in verdict
    assert any("balance of the water, " in text for text in others)
    assert any(f"with {HOLE}" in text for text in others)


def test_programs_read_names(worded):
    content = as_json(worded)
    assert content["ambiguity_set"] == [["leak"]]
    assert HOLE not in str(content)


def test_a_name_without_words_stays_as_it_is(worded):
    assert in_words(worded, "leak") == HOLE
    assert in_words(worded, "leak + recalibrated") == f"{HOLE} + recalibrated"
    assert in_words(diagnosed("known"), "leak") == "leak"


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


def test_values_are_trusted_as_far_as_the_verdict():
    assert set(calibrated_values(diagnosed("unknown"), "bad").statuses) == {"bad"}
