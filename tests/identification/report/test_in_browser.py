"""A page with everything on it, in a real browser."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from identification.report.page import ANSWERS, LABELS, Picture, Section, Table, Verdict, write_page
from tests.identification.browser import (
    DESK,
    PHONE,
    box,
    check_layout,
    opened,
    smallest_letters,
    style,
    unfold,
    width_of_content,
)


def a_figure() -> Figure:
    figure = Figure(figsize=(9, 6.5))
    figure.subplots().plot(np.sin(np.linspace(0, 20, 300)))
    return figure


def a_section(number: int) -> Section:
    wide = Table(
        columns=[f"a long heading {i}" for i in range(14)],
        rows=[[f"{i * j:.6f}" for i in range(14)] for j in range(25)],
        caption="A table that no phone has room for.",
    )
    return Section(
        title=f"Stage {number}",
        verdicts=[Verdict(status=s, text="a sentence of some length. " * 4) for s in LABELS],
        blocks=["unbroken" * 30, wide, Picture(figure=a_figure(), caption="A figure.")],
    )


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    values = Table(
        columns=["Parameter", "value", "trust it"],
        rows=[[f"parameter {s}", "1 (0 to 2) Ohm", s] for s in ("good", "doubt", "bad")],
        statuses=["good", "doubt", "bad"],
    )
    summary = Section(title="Values", verdicts=[], blocks=[values], summary=True)
    sections = [summary, *map(a_section, range(4))]
    write_page(path, title="Page", sections=sections, facts={"Campaign": "unit tests"})
    return path


def test_it_fits_a_desk_a_phone_and_paper(page_file, tmp_path):
    check_layout(page_file, tmp_path)


def test_each_status_has_a_colour_of_its_own(page_file):
    """Once `.verdicts li` outranked the colours, and all bars were grey."""
    with opened(page_file, DESK) as page:
        bars = {s: style(page, f".verdicts .{s}", "borderLeftColor") for s in LABELS}
        text = style(page, ".verdicts .good", "color")
        cells = [style(page, f".judging .{s} td:last-child", "borderLeftColor") for s in ANSWERS]
    assert len({*bars.values(), text}) == 5
    assert bars["why"] == bars["doubt"]
    assert bars["next"] == bars["note"]
    assert cells == [bars[s] for s in ANSWERS]


def test_a_click_unfolds_a_section_enlarges_a_figure_and_another_closes_it(page_file):
    with opened(page_file, DESK) as page:
        page.click("details:nth-of-type(2) summary")
        before = box(page, "#figure-2 img")
        page.click("#figure-2 img")
        frame, large = box(page, "#figure-2"), box(page, "#figure-2 img")
        page.click("#figure-2 .close")
        after = box(page, "#figure-2 img")
    assert (frame["top"], frame["width"]) == (0, DESK[0])
    assert large["width"] > 1.5 * before["width"]
    assert after["width"] == before["width"]
    assert 0 <= after["top"] < DESK[1]  # the reader is where the reader was


def test_the_checks_can_fail(page_file, tmp_path):
    bad = tmp_path / "bad.html"
    text = page_file.read_text(encoding="utf-8")
    bad.write_text(text.replace("overflow-x: auto", "").replace("font: 15px", "font: 9px"), "utf-8")
    with opened(bad, PHONE) as page:
        unfold(page)
        assert width_of_content(page) > PHONE[0]
        assert smallest_letters(page) < 12
