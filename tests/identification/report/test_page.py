"""The HTML page: every text escaped, the summary open, and what it rests on."""

import html
import re
from dataclasses import replace
from datetime import datetime

from matplotlib.figure import Figure

from identification.report.page import Picture, Section, Table, Verdict, write_page

UNSAFE = "<b>5 & 'a' \"b\"</b>"


def written(path, *sections):
    write_page(path, title="Page", sections=sections)
    return path.read_text(encoding="utf-8")


def full_section(title="First"):
    return Section(
        title=title,
        verdicts=[Verdict(status="doubt", text=UNSAFE)],
        blocks=[
            UNSAFE,
            Table(columns=["x", "y"], rows=[["1", UNSAFE], ["2", "3"]], caption="Numbers."),
            Picture(figure=Figure(figsize=(1, 1)), caption=UNSAFE),
        ],
    )


def test_every_text_is_escaped(tmp_path):
    text = written(tmp_path / "page.html", full_section())
    assert UNSAFE not in text
    assert html.unescape(text).count(UNSAFE) == 5  # an alternative text and a caption for the picture


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
    facts = {"Recordings": "test1"}
    write_page(tmp_path / "page.html", title="Page", sections=[full_section()], facts=facts)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<dt>Recordings</dt><dd>test1</dd>" in text
    year = datetime.now().astimezone().year
    assert re.search(rf"<dd>\d+ \w+ {year}, \d\d:\d\d, by epv-valve \d", text)
