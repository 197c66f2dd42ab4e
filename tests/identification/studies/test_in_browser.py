"""The pages of the blind study, of its disturbed trials and of the coverage study, in a real browser."""

from pathlib import Path

import numpy as np
import pytest

from identification.report.page import Section, write_page
from identification.studies.blind.blind_section import blind_section
from identification.studies.blind.robustness_section import PairOfScores, robustness_section
from identification.studies.blind.score import TrialScore, score_trial
from identification.studies.blind.settings import DEFAULTS
from identification.studies.coverage.coverage import Coverage
from identification.studies.coverage.coverage_section import coverage_section
from tests.identification.browser import check_layout
from tests.identification.studies.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label

BOTH = ["eddy_current", "flyback_voltage"]


def scores() -> list[TrialScore]:
    """Trials of every kind with every verdict."""
    pair = (BOTH, 0.7, {**EDDY[2], **CLAMP[2]})
    outcomes = [
        (label(), answer("known", EDDY, CLAMP)),
        (label(), answer("ambiguous", CLAMP, EDDY, named=2)),
        (label(), answer("partial", EDDY)),
        (label("pair", BOTH), answer("known", pair)),
        (label("left_out", ["inlet_seat_leak"]), answer("unknown", EDDY)),
        (NOTHING, answer("no_gap", component="")),
        (NOTHING, answer("known", EDDY)),
    ]
    return [
        score_trial({**truth, "trial": 7 * i + j}, said, None)
        for i in range(8)
        for j, (truth, said) in enumerate(outcomes)
    ]


def coverage() -> Coverage:
    """Campaigns whose distances follow chi-square's distribution."""
    rng = np.random.default_rng(0)
    distance = rng.chisquare(4, 200)
    inside = rng.random((200, 4)) < 0.95
    return Coverage(
        symbols=("alphaMV", "alphaPV", "RML", "R"),
        distance=distance,
        independent=2 * distance,
        disagreement=0.1 * distance,
        inside=inside,
        report_inside=~inside,
        report_joint=inside[:, 0],
    )


SECTIONS = {
    "blind": lambda: blind_section(scores(), DEFAULTS),
    "ripple": lambda: robustness_section(
        "ripple", [PairOfScores(before=score, after=score) for score in scores()]
    ),
    "coverage": lambda: coverage_section(coverage()),
}


@pytest.mark.parametrize("name", SECTIONS)
def test_its_page_fits_a_desk_a_phone_and_paper(name, tmp_path):
    section: Section = SECTIONS[name]()
    path: Path = tmp_path / "page.html"
    write_page(path, title=section.title, sections=[section], footer="unit tests")
    check_layout(path, tmp_path)
