"""The HTML page: every text escaped, one colour per status, and a clear sentence without Jinja2."""

import html
import re
import sys

import pytest
from matplotlib.figure import Figure

from identification.report import page as module
from identification.report.page import Picture, Section, Table, Text, Verdict, write_page

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


def test_a_page_holds_what_it_was_given(tmp_path):
    text = written(tmp_path / "page.html", full_section())
    assert "<b>in doubt</b>" in text
    assert "<th>x</th><th>y</th>" in text
    assert "<tr><td>2</td><td>3</td></tr>" in text
    assert "<caption>Numbers.</caption>" in text
    assert text.count("data:image/png;base64,") == 1
    assert "<h2>Verdicts</h2>" not in text


def test_the_verdicts_of_several_sections_come_first(tmp_path):
    text = written(tmp_path / "page.html", full_section(), full_section("Second"))
    headings = re.findall(r"<h[123]>(.*?)</h[123]>", text)
    assert headings == ["Page", "Verdicts", "First", "Second", "First", "Second"]
    assert text.count('<li class="doubt">') == 4


def test_each_status_has_a_colour_that_no_other_rule_outranks(tmp_path):
    """`.verdicts li` sets the bar; a colour of a lone class would lose against that rule."""
    style = re.search(r"<style>(.*?)</style>", written(tmp_path / "page.html"), re.DOTALL)
    assert style is not None
    colours = dict(re.findall(r"\.verdicts \.(\w+) { border-color: (#\w+) }", style[1]))
    assert set(colours) == set(module.LABELS)
    assert len(set(colours.values())) == len(colours)


def test_a_page_without_jinja2_is_refused_in_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    module._template.cache_clear()
    with pytest.raises(ImportError, match=r"needs Jinja2, which is not installed: pip install"):
        written(tmp_path / "page.html", full_section())
    assert not (tmp_path / "page.html").exists()
    module._template.cache_clear()
