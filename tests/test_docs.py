"""What the documentation shows runs as printed, and its links and names lead somewhere."""

import importlib
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("mkdocstrings")
pytestmark = pytest.mark.training

from markdown.extensions.toc import slugify_unicode  # noqa: E402

from epv_env.common.commands import commands  # noqa: E402
from epv_env.common.options import parse  # noqa: E402
from epv_env.plant.plantfile import load_plant  # noqa: E402
from identification.bench.programmes import load_programmes  # noqa: E402
from identification.importing.mapping_file import read_mapping  # noqa: E402
from tests.test_extras import blocker  # noqa: E402
from training.epv import PACKAGES as COMMAND_PACKAGES  # noqa: E402

ROOT = Path(__file__).parents[1]
PACKAGES = ("epv_env", "identification", "controllers", "training")
PAGES = tuple(
    path.relative_to(ROOT).as_posix()
    for path in sorted((*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")))
)
"""Every page, as a path from the root."""
FENCE = re.compile(r"^ *```.*?^ *```", re.S | re.M)
HEADLESS = {**os.environ, "SDL_VIDEODRIVER": "dummy", "MPLBACKEND": "agg", "NO_MKDOCS_2_WARNING": "1"}
COMMANDS = commands(COMMAND_PACKAGES)
PREFIXES = ("epv", "python -m identification")
"""What stands before a command's name on the pages."""


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str, language: str) -> list[str]:
    """The examples of a page in one language, without their indentation."""
    found = re.findall(rf"^ *```{language}\n(.*?)^ *```", text(page), re.S | re.M)
    return [
        re.sub(r"^   +(?=\S)", "", block, flags=re.M) if language == "sh" else block for block in found
    ]


def run(*command, cwd: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        command, cwd=cwd, env=HEADLESS, capture_output=True, text=True, timeout=300, check=False
    )


def extras(page: str) -> set[str]:
    """The extras that a page tells its readers to install."""
    named = r"pip install '\.\[([\w,-]+)\]'|extra\s`([\w-]+)`|`([\w-]+)`\sextra"
    found = {name for names in re.findall(named, text(page)) for name in "".join(names).split(",")}
    return found | ({"all"} if "make venv" in text(page) else set())


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")])
def test_the_examples_of_a_page_run(page, tmp_path):
    """One after another, as a reader would paste them, with only the extras that the page names."""
    script = tmp_path / "examples.py"
    script.write_text("\n\n".join([blocker(*extras(page)), *blocks(page, "python")]), encoding="utf-8")
    done = run(sys.executable, script, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


READERS: dict[str, Callable[[Path], object]] = {
    "epv-plant/1": load_plant,
    "epv-mapping/1": read_mapping,
    "epv-programme/1": load_programmes,
}
"""What reads a file of a format, where the file stands for itself."""


def test_the_files_shown_can_be_read(tmp_path):
    shown = [block for page in PAGES for block in blocks(page, "json")]
    for number, block in enumerate(shown):
        (path := tmp_path / f"{number}.json").write_text(block, encoding="utf-8")
        READERS.get(json.loads(block)["format"], Path.read_text)(path)
    assert READERS.keys() <= {json.loads(block)["format"] for block in shown}


def shell_commands(shell: str) -> Iterator[list[str]]:
    """The commands of shell lines as lists of words, without comments and assignments."""
    for line in shell.replace("\\\n", " ").splitlines():
        for part in line.split("#")[0].split("&&"):
            words = shlex.split(part)
            while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
                words.pop(0)
            if words:
                yield words


def command_of(words: list[str]) -> tuple[str, list[str]] | None:
    """Module and options of a command of this project; None for another program's."""
    line = " ".join(words)
    for prefix in PREFIXES:
        if line.startswith(prefix + " "):
            name, *options = words[len(prefix.split()) :]
            return COMMANDS[name], options
    script = re.match(r"python training/(\w+)\.py", line)
    if script:
        name = script[1].removesuffix("_ppo")
        return COMMANDS[name], words[2:]
    return None


def test_commands_shown_are_those_of_the_parsers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [
        (page, words)
        for page in PAGES
        for block in blocks(page, "sh")
        for words in shell_commands(block)
    ]
    found = [(page, *command) for page, words in lines if (command := command_of(words)) is not None]
    assert len(found) > 15
    for page, module, options in found:
        try:
            parse(importlib.import_module(module), module, options)
        except SystemExit:
            pytest.fail(f"{page}: {module} {' '.join(options)}")


def test_make_targets_shown_exist():
    targets = set(re.findall(r"^([a-z][a-z-]*)%?:", text("Makefile"), re.M))
    for page in PAGES:
        for target in re.findall(r"(?:^|`)make ([a-z][a-z-]*)", text(page), re.M):
            assert target in targets or target.startswith("study-"), f"{page}: make {target}"


def anchors(page: str) -> set[str]:
    """The names under which the headings of a page can be linked to."""
    headings = re.findall(r"^#+ +(.*)$", FENCE.sub("", text(page)), re.M)
    return {slugify_unicode(heading, "-") for heading in headings}


def test_links_lead_somewhere():
    for page in PAGES:
        for link in re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", text(page))):
            if link.startswith("http"):
                continue
            path, _, anchor = link.partition("#")
            target = (ROOT / page).parent / path if path else ROOT / page
            assert target.exists(), f"{page}: {link}"
            if anchor:
                found = anchors(target.resolve().relative_to(ROOT).as_posix())
                assert anchor in found, f"{page}: {link}"


def test_files_named_on_a_page_exist():
    tops = "|".join((*PACKAGES, "docs", "tests"))
    for page in PAGES:
        if page == "CHANGELOG.md":
            continue
        for path in re.findall(rf"`((?:{tops})/[\w./-]+)`", FENCE.sub("", text(page))):
            assert (ROOT / path).exists(), f"{page}: {path}"


def test_pages_named_in_the_code_exist():
    """In docstrings, messages and help texts: docs/reference/files.md."""
    files = [path for package in (*PACKAGES, "docs") for path in (ROOT / package).rglob("*.py")]
    for path in (*files, ROOT / "Makefile"):
        for page in re.findall(r"\bdocs/[\w/-]+\.md", path.read_text(encoding="utf-8")):
            assert (ROOT / page).exists(), f"{path.relative_to(ROOT)} names {page}"


def test_pages_are_short():
    words = {page: len(text(page).split()) for page in PAGES}
    assert words["README.md"] <= 900
    assert {page: count for page, count in words.items() if count > 2500} == {}
    assert {p: n for p, n in words.items() if p.startswith("docs/studies") and n > 1200} == {}


def test_the_site_builds_without_a_warning(tmp_path):
    """A warning fails: a broken link, a page outside the navigation."""
    done = run(sys.executable, "-m", "mkdocs", "build", "--strict", "-d", tmp_path / "site", cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site/reference/api/epv_env.plant.html").is_file()
    assert "<code>epv sweep</code>" in (tmp_path / "site/reference/command-lines.html").read_text()
    assert (
        "<td><code>eddy_current</code></td>" in (tmp_path / "site/explanation/effects.html").read_text()
    )
    pages = "".join(path.read_text() for path in (tmp_path / "site").glob("*.html"))
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=\"?https?:", pages)
    assert '<script src="assets/iframe-worker.js"' in pages  # the search works from the disk
    assert (tmp_path / "site/search/search_index.js").is_file()
    api = (tmp_path / "site/reference/api/epv_env.html").read_text()
    _, example = api.split("environments of an electro-pneumatic protection valve.</p>", 1)
    assert example.lstrip().startswith('<div class="language-python highlight">')


def test_the_cells_of_the_notebook_run_and_print_what_it_shows():
    cells = json.loads(text("docs/start/ten-cells.ipynb"))["cells"]
    assert len(cells) == 10
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    assert sum(output["output_type"] == "display_data" for output in outputs) == 4
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    done = run(sys.executable, "-c", code, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "".join(line for output in outputs for line in output.get("text", []))


def test_how_good_it_is_stands_behind_each_row():
    """Every figure of an answer is one of the page that the row links to."""
    page = "docs/studies/README.md"
    rows = re.findall(r"^\| .*\? \| (.*) \| .*\]\(([^)#]*)[^)]*\) \|$", text(page), re.M)
    assert 4 < len(rows) <= 6
    for answer, link in rows:
        behind = ((ROOT / page).parent / link).read_text(encoding="utf-8")
        for figure in re.findall(r"(?<![\d\w])\d[\d.]*(?<!\.)", answer):
            assert re.search(rf"(?<![\d.]){re.escape(figure)}(?![\d])", behind), f"{figure}: {link}"
