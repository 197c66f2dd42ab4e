"""What the documentation shows runs as printed."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
pytestmark = pytest.mark.training

ROOT = Path(__file__).parents[1]
PAGES = (
    "README.md",
    "docs/env.md",
    "docs/data.md",
    "docs/explanation/identification.md",
    "docs/explanation/effects.md",
    "docs/explanation/learning.md",
)
OTHERS = (
    *(f"docs/{path.parent.name}/{path.name}" for path in sorted((ROOT / "docs").glob("[er]*/*.md"))),
    "docs/deploy.md",
)
"""Pages without examples."""
HEADLESS = {**os.environ, "SDL_VIDEODRIVER": "dummy"}


def blocks(page: str) -> list[str]:
    """The Python examples of a page."""
    return re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.S | re.M)


def run(*command, cwd: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        command, cwd=cwd, env=HEADLESS, capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.parametrize("page", PAGES)
def test_the_examples_of_a_page_run(page, tmp_path):
    """One after another, as a reader would paste them."""
    script = tmp_path / "examples.py"
    script.write_text("\n\n".join(blocks(page)), encoding="utf-8")
    assert blocks(page)
    done = run(sys.executable, script, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", [*PAGES, *OTHERS])
def test_links_lead_somewhere(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if not link.startswith("http"):
            assert ((ROOT / page).parent / link).exists(), link


def test_the_film_in_its_shortest_form(tmp_path):
    out = tmp_path / "valve.gif"
    script = ROOT / "docs/scripts/film.py"
    done = run(sys.executable, script, "--seconds", "0.05", "--out", out, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert out.read_bytes()[:3] == b"GIF"


def test_the_pictures_of_the_identification_in_their_shortest_form(tmp_path):
    options = ("--coverage", tmp_path / "coverage", "--campaigns", "2")
    script = ROOT / "docs/scripts/identification_figures.py"
    done = run(sys.executable, script, "--out", tmp_path, *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in tmp_path.glob("*.png")}
    assert names == {"calibration.png", "region.png", "coverage.png"}
    assert names <= {path.name for path in (ROOT / "docs/images").iterdir()}
