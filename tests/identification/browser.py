"""Reports in a real browser: what a reader sees on a desk, on a phone and on paper."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from typing import Any

import numpy as np
import pytest

DESK, PHONE = (1280, 800), (400, 800)
"""Windows [pixels]: width, height."""

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Names of the distribution's browser."""

LEAST_FILLED = 0.5
"""Share of a printed page that is used, the last page apart [1]."""


@contextmanager
def opened(path: Path, window: tuple[int, int]) -> Iterator[Any]:
    """The page in a window of the distribution's browser; skips where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs the extra 'browser'")
    browser = next((found for name in BROWSERS if (found := which(name))), None)
    if browser is None:
        pytest.skip(f"no browser is installed: looked for {', '.join(BROWSERS)}")
    as_root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=browser, args=as_root)
        page = chromium.new_page(viewport={"width": window[0], "height": window[1]})
        page.goto(path.resolve().as_uri())
        yield page
        chromium.close()


def unfold(page: Any) -> None:
    """Open every section."""
    page.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")


def screenshot(page: Any, path: Path) -> None:
    """A picture of the whole page; fails for a blank one."""
    page.screenshot(path=path, full_page=True)
    assert len(page.evaluate("document.body.innerText")) > 100
    assert path.stat().st_size > 10_000


def width_of_content(page: Any) -> int:
    """How wide the page is, with what sticks out of the window [pixels]."""
    return page.evaluate("document.documentElement.scrollWidth")


def box(page: Any, selector: str) -> dict[str, float]:
    """Place of the first element in the window: top, bottom, left, right, width, height [pixels]."""
    return page.evaluate("s => document.querySelector(s).getBoundingClientRect().toJSON()", selector)


def style(page: Any, selector: str, name: str) -> str:
    """A computed style of the first element."""
    script = "([s, name]) => getComputedStyle(document.querySelector(s))[name]"
    return page.evaluate(script, [selector, name])


def smallest_letters(page: Any) -> float:
    """Least size of the letters of any text [pixels]."""
    script = """() => Math.min(...[...document.querySelectorAll("p, li, td, th, dd, dt, figcaption, a")]
        .filter(e => e.innerText).map(e => parseFloat(getComputedStyle(e).fontSize)))"""
    return page.evaluate(script)


def dead_links(page: Any) -> list[str]:
    """Links to places that the page does not have."""
    script = """() => [...document.querySelectorAll("a[href^='#']")].map(a => a.getAttribute("href"))
        .filter(h => !document.getElementById(h.slice(1)))"""
    return page.evaluate(script)


def filled_shares(page: Any) -> list[float]:
    """How much of the height of every printed page is used [1]."""
    pdfium = pytest.importorskip("pypdfium2", reason="needs the extra 'browser'")
    document = pdfium.PdfDocument(page.pdf(format="A4"))
    shares = []
    for sheet in document:
        ink = np.asarray(sheet.render(scale=0.5, grayscale=True).to_numpy()).squeeze() < 250
        rows = np.flatnonzero(ink.any(axis=1))
        shares.append((rows[-1] + 1) / len(ink) if len(rows) else 0.0)
    return shares


def check_layout(path: Path, pictures: Path) -> None:
    """What holds for every report: nothing sticks out, all can be read, links work, pages are full."""
    for name, window in {"desk": DESK, "phone": PHONE}.items():
        with opened(path, window) as page:
            unfold(page)
            screenshot(page, pictures / f"{name}.png")
            assert width_of_content(page) <= window[0]
            assert smallest_letters(page) >= 12
            assert dead_links(page) == []
            if window == DESK:
                filled = filled_shares(page)
                assert min(filled[:-1], default=1.0) >= LEAST_FILLED
