"""The HTML page: every text escaped, one colour per status, and a clear sentence without Jinja2."""

import html
import re
import sys
from dataclasses import replace
from datetime import datetime

import pytest
from matplotlib.figure import Figure

from identification.report.page import Picture, Section, Table, Text, Verdict, as_svg, write_page

UNSAFE = "<b>5 & 'a' \"b\"</b>"


def written(path, *sections, footer=""):
    write_page(path, title="Page", sections=sections, footer=footer)
    return path.read_text(encoding="utf-8")


def full_section(title="First"):
    return Section(
        title=title,
        verdicts=[Verdict(status="doubt", text=UNSAFE)],
        blocks=[
            Text(text=UNSAFE),
            Table(columns=["x", "y"], rows=[["1", UNSAFE], ["2", "3"]], caption="Numbers."),
            Picture(figure=Figure(figsize=(1, 1)), caption=UNSAFE),
        ],
    )


def test_every_text_is_escaped(tmp_path):
    text = written(tmp_path / "page.html", full_section(), footer=UNSAFE)
    assert UNSAFE not in text
    assert html.unescape(text).count(UNSAFE) == 6  # an alternative text and a caption for the picture


def test_the_summary_alone_is_open_and_a_folded_section_says_that_it_is_in_doubt(tmp_path):
    sure = replace(full_section("Second"), verdicts=[Verdict(status="good", text="All is well.")])
    summary = replace(full_section("Answer"), summary=True)
    text = written(tmp_path / "page.html", full_section(), sure, summary)
    assert re.findall(r"<h[123]>(.*?)</h[123]>", text) == ["Page", "Answer"]
    assert "open" not in re.findall(r"<details.*?>", text)[0]
    folded = [re.sub(r"<.*?>", "", line) for line in re.findall(r"<summary>(.*?)</summary>", text)]
    assert folded == ["First in doubt", "Second"]
    assert (text.count('<li class="doubt">'), text.count('<li class="good">')) == (2, 1)
    alone = written(tmp_path / "page.html", full_section())
    assert re.findall(r"<details.*?>", alone) == ["<details open>"]


def test_the_page_says_what_it_rests_on_and_when_it_was_written(tmp_path):
    write_page(
        tmp_path / "page.html",
        title="Page",
        sections=[full_section()],
        facts={"Recordings": "test1"},
        written=datetime(2026, 11, 3, 14, 5),
    )
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<dt>Recordings</dt><dd>test1</dd>" in text
    assert "<dt>Written</dt><dd>3 November 2026, 14:05</dd>" in text


def test_a_cloud_of_points_costs_no_more_than_its_pixels():
    """As shapes 20,000 points take more than a megabyte."""
    figure = Figure(figsize=(2, 2))
    figure.subplots().plot(range(20_000), ".")
    assert len(as_svg(figure)) < 100_000


def test_a_page_without_jinja2_is_refused_in_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(ImportError, match=r"needs Jinja2, which is not installed: pip install"):
        written(tmp_path / "page.html", full_section())
    assert not (tmp_path / "page.html").exists()
