"""What the documentation shows runs as printed."""

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.documented_commands import NOT_RUN, SHORT_FORMS, beginning, commands, recipe, shell_blocks

pytest.importorskip("stable_baselines3")
pytest.importorskip("mkdocstrings")
pytestmark = pytest.mark.training

import griffe  # noqa: E402
from markdown.extensions.toc import slugify_unicode  # noqa: E402

from docs.scripts.command_lines import parser_of  # noqa: E402
from docs.scripts.effects_table import effects_table  # noqa: E402
from docs.scripts.hooks import undocumented  # noqa: E402

ROOT = Path(__file__).parents[1]
PACKAGES = ("epv_env", "identification", "controllers", "training")
PAGES = tuple(
    path.relative_to(ROOT).as_posix()
    for path in sorted((*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")))
)
"""Every page, as a path from the root."""
FENCE = re.compile(r"^ *```.*?^ *```", re.S | re.M)
HEADLESS = {**os.environ, "SDL_VIDEODRIVER": "dummy", "NO_MKDOCS_2_WARNING": "1"}


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str) -> list[str]:
    """The Python examples of a page."""
    return re.findall(r"^```python\n(.*?)^```", text(page), re.S | re.M)


def run(*command, cwd: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        command, cwd=cwd, env=HEADLESS, capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)])
def test_the_examples_of_a_page_run(page, tmp_path):
    """One after another, as a reader would paste them."""
    script = tmp_path / "examples.py"
    script.write_text("\n\n".join(blocks(page)), encoding="utf-8")
    done = run(sys.executable, script, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def anchors(page: str) -> set[str]:
    """The names under which the headings of a page can be linked to."""
    headings = re.findall(r"^#+ +(.*)$", FENCE.sub("", text(page)), re.M)
    return {slugify_unicode(heading, "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", text(page))):
        if link.startswith("http"):
            continue
        path, _, anchor = link.partition("#")
        target = (ROOT / page).parent / path if path else ROOT / page
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target.resolve().relative_to(ROOT).as_posix()), link


@pytest.mark.parametrize("page", PAGES)
def test_files_named_on_a_page_exist(page):
    """In code, and not in a block: `identification/gap/diagnosis.py`."""
    if page == "CHANGELOG.md" or page.startswith("docs/blind"):
        return
    tops = "|".join((*PACKAGES, "docs", "tests"))
    for path in re.findall(rf"`((?:{tops})/[\w./-]+)`", FENCE.sub("", text(page))):
        assert (ROOT / path).exists(), path


def test_pages_named_in_the_code_exist():
    """In docstrings, messages and help texts: docs/reference/files.md."""
    files = [path for package in (*PACKAGES, "docs") for path in (ROOT / package).rglob("*.py")]
    for path in (*files, ROOT / "Makefile"):
        if path != Path(__file__):
            for page in re.findall(r"\bdocs/[\w/-]+\.md", path.read_text(encoding="utf-8")):
                assert (ROOT / page).exists(), f"{path.relative_to(ROOT)} names {page}"


def shown() -> Iterator[tuple[str, list[str]]]:
    """Every command of a page, with the page; those of a make target instead of the target."""
    for page in PAGES:
        for block in shell_blocks(text(page)):
            for words in commands(block):
                if words[0] != "make":
                    yield page, words
                    continue
                for target in (word for word in words[1:] if "=" not in word):
                    yield from ((page, line) for line in commands(recipe(target)))


def test_every_command_shown_runs_in_a_short_form():
    """A command has an entry in tests/documented_commands.py, and the entry's test exists."""
    python = [(page, words) for page, words in shown() if words[0] not in ("rm", "sed", "find", "echo")]
    assert len(python) > 40
    unknown = {f"{page}: {' '.join(words)}" for page, words in python if beginning(words) is None}
    assert not unknown, f"give these an entry in tests/documented_commands.py: {unknown}"
    for command, test in SHORT_FORMS.items():
        assert (ROOT / test).exists(), f"{command}: {test} is gone"


def test_a_command_without_a_short_form_is_found():
    assert beginning(["python", "training/new.py"]) is None
    assert beginning(["python", "-m", "identification", "gap", "x"]) == "python -m identification gap"
    assert commands("A=1 python x.py --out y # why\n. .venv/bin/activate && make z") == [
        ["python", "x.py", "--out", "y"], [".", ".venv/bin/activate"], ["make", "z"],
    ]  # fmt: skip
    assert set(SHORT_FORMS).isdisjoint(NOT_RUN)


def test_options_shown_are_those_of_the_commands(tmp_path, monkeypatch):
    """The commands' own parsers accept what the pages show."""
    monkeypatch.chdir(tmp_path)
    for page, words in shown():
        length = 2 if words[0] == "epv" or words[1:2] != ["-m"] else 3
        if words[:3] == ["python", "-m", "identification"]:
            length = 4
        command, rest = " ".join(words[:length]), words[length:]
        if not re.match(
            r"epv .|python training/|python -m (identification|docs.(examples.tank|studies))", command
        ):
            continue
        parser = parser_of(command)
        try:
            parser.parse_args(rest)
        except SystemExit:
            pytest.fail(f"{page}: {' '.join(words)}")


def test_a_name_without_a_docstring_is_found():
    source = (
        "def shown(): ...\ndef _hidden(): ...\nclass Documented:\n    '''x'''\n    def told(self): ..."
    )
    with griffe.temporary_visited_module(source, module_name="sample") as module:
        assert set(undocumented(module)) == {"sample.shown", "sample.Documented.told"}


def test_the_readme_is_short():
    assert len(text("README.md").split()) <= 900
    table = re.search(r"<!-- generated: short -->\n(.*?)\n<!-- end: short -->", text("README.md"), re.S)
    assert table is not None
    rows = [line.strip("| ").split(" | ") for line in table[1].splitlines()[2:]]
    assert 0 < len(rows) <= 6
    assert {len(row) for row in rows} == {5}
    assert sum(line.startswith("| ---") for line in text("README.md").splitlines()) == 1


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("docs/explanation")])
def test_pages_of_explanation_are_short(page):
    assert len(text(page).split()) <= 2500


def imported_packages(page: str) -> dict[str, set[str]]:
    """Rows of the table of packages: what each may import."""
    rows = re.findall(r"^\| `([\w.]+)` \|.*\| ([^|]*) \|$", text(page), re.M)
    return {name: set(re.findall(r"`([\w.]+)`", may)) for name, may in rows}


def imports(path: Path) -> set[str]:
    """Dotted names that a file imports."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}


def test_the_page_of_the_architecture_says_who_imports_whom():
    allowed = imported_packages("docs/architecture.md")
    assert len(allowed) > 6

    def group(name: str) -> str | None:
        fitting = [g for g in allowed if f"{name}.".startswith(f"{g}.")]
        return max(fitting, key=len, default=None)

    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            own = group(".".join(path.relative_to(ROOT).with_suffix("").parts))
            assert own is not None, path
            others = {group(name) for name in imports(path)} - {own, None}
            assert others <= allowed[own], f"{path} imports {others - allowed[own]}"


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    """A warning fails: a broken link, a page outside the navigation, a public name without docstring."""
    done = run(sys.executable, "-m", "mkdocs", "build", "--strict", "-d", tmp_path / "site", cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site/reference/api/epv_env.plant.html").is_file()
    assert "--generations" in (tmp_path / "site/reference/command-lines.html").read_text()
    pages = "".join(path.read_text() for path in (tmp_path / "site").glob("*.html"))
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=\"?https?:", pages)


def test_the_film_in_its_shortest_form(tmp_path):
    out = tmp_path / "valve.gif"
    done = run(
        sys.executable, ROOT / "docs/scripts/film.py", "--seconds", "0.05", "--out", out, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert out.read_bytes()[:3] == b"GIF"


def test_the_table_of_effects_is_that_of_the_records():
    """Written by `python -m docs.scripts.effects_table`."""
    assert effects_table() in text("docs/explanation/effects.md")
