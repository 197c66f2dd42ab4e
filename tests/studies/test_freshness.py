"""Every table of figures is of the present code, or says that it is not."""

import re

import pytest

from docs.studies import common, freshness

OF = "<!-- generated: rows, study speed, code {} -->\n{}<!-- end: rows -->\n"
OLD = freshness.OLD.format("1a2b3c4d", "speed") + "\n"


def test_every_table_is_of_this_code_or_says_that_it_is_old():
    complaints = [
        f"{page}: {table['name']!r} was measured on code {table['code']}, this is "
        f"{freshness.code_of(table['study'])}: run `make studies ARGS={table['study']}` again, or "
        "say that it is old with `make studies ARGS=--old`"
        for page, table in freshness.stale_tables()
        if not freshness.says_so(table)
    ]
    assert complaints == []


def test_every_generated_part_names_a_study_that_runs():
    for page in freshness.pages():
        text = page.read_text(encoding="utf-8")
        studies = [table["study"] for table in freshness.TABLE.finditer(text)]
        assert len(studies) == text.count("<!-- generated: "), page
        assert set(studies) <= set(freshness.STUDIES)
    for study, (_, runs) in freshness.STUDIES.items():
        assert {f"docs/studies/{study}/{run.split()[0]}.py" for run in runs} <= set(
            freshness.dependencies(study)
        )


def test_a_study_depends_on_what_it_imports_and_on_the_data_beside():
    policy, judge = "controllers/trained/policy.safetensors", "identification/gap/judge/verdict.py"
    plant = {"epv_env/plant/parameters.json", "epv_env/plant/equations.py"}
    comparison, blind = map(freshness.dependencies, ("comparison", "blind"))
    assert plant | {policy, "epv_env/env.py"} <= set(comparison)
    assert plant | {judge, "tests/reference/hybrid_automaton.py"} <= set(blind)
    assert judge not in comparison
    assert policy not in blind


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ('"""Other."""\ndef f(x):  # why\n    """More."""\n    return (x + 0)\n', True),
        ('"""Prose."""\ndef f(x):\n    return x + 1\n', False),
        ('"""Prose."""\ndef f(x):\n    return x + False\n', False),
        ('"""Prose."""\ndef f(x):\n    return x - 0\n', False),
    ],
)
def test_prose_and_layout_are_no_code(tmp_path, text, same):
    before, after = tmp_path / "before.py", tmp_path / "after.py"
    before.write_text('"""Prose."""\ndef f(x):\n    return x + 0\n')
    after.write_text(text)
    assert (freshness.read(before)[0] == freshness.read(after)[0]) is same


@pytest.mark.parametrize(
    ("text", "stale", "says_so"),
    [
        (OF.format("now", "| 1 |\n"), False, None),
        (OF.format("before", "Not measured\n"), False, None),
        (OF.format("before", "| 1 |\n"), True, False),
        (OF.format("before", OLD), True, True),
        (OF.format("before", OLD.replace("speed", "other")), True, False),
        (OF.format("before", "| 1 |\n\n" + OLD), True, False),
    ],
)
def test_a_stale_table_is_found_until_it_is_measured(tmp_path, monkeypatch, text, stale, says_so):
    page = tmp_path / "README.md"
    page.write_text(text)
    monkeypatch.setattr(freshness, "pages", lambda: [page])
    for module in (freshness, common):
        monkeypatch.setattr(module, "code_of", lambda study: "now")
    assert [freshness.says_so(table) for _, table in freshness.stale_tables()] == [says_so] * stale
    common.fill(page, {"rows": "| 2 |"})
    assert page.read_text() == OF.format("now", "| 2 |\n")
    assert list(freshness.stale_tables()) == []


def test_a_table_is_marked_as_old_once(tmp_path, monkeypatch):
    page = tmp_path / "README.md"
    page.write_text(OF.format("before", "| 1 |\n"))
    monkeypatch.setattr(freshness, "pages", lambda: [page])
    monkeypatch.setattr(freshness, "STUDIES", {"speed": (1, ("study",))})
    monkeypatch.setattr(freshness, "code_of", lambda study: "now")
    monkeypatch.setattr(freshness, "commit_of", lambda page, code: "1a2b3c4d")
    for _ in range(2):
        assert freshness.main(["--old"]) == 0
        assert page.read_text() == OF.format("before", f"{OLD}\n| 1 |\n")


def test_stale_studies_run_the_cheapest_first(tmp_path, monkeypatch, capsys):
    page, ran = tmp_path / "README.md", []
    table = OF.format("before", "| 1 |\n")
    page.write_text(table.replace("speed", "logs") + table.replace("speed", "blind"))
    monkeypatch.setattr(freshness, "pages", lambda: [page])
    monkeypatch.setattr(freshness, "code_of", lambda study: "now")
    monkeypatch.setattr(freshness, "measure", lambda run: ran.append(run) or True)
    assert freshness.main([]) == 0
    blind, logs = freshness.STUDIES["blind"], freshness.STUDIES["logs"]
    assert ran == [*(f"blind.{run}" for run in blind[1]), "logs.study --valves 60"]
    assert re.findall(r"(\w+): about (\d+) min", capsys.readouterr().out) == [
        ("blind", f"{blind[0]}"), ("logs", f"{logs[0]}"),
    ]  # fmt: skip
    assert freshness.main(["--list"]) == 0
    assert len(ran) == 3
