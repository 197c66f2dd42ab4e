"""The page of the report's tables shows what was computed."""

import json

from docs.studies.reproduction.study import FOLDER, page_parts


def test_the_page_shows_the_published_results():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    published = json.loads((FOLDER / "reproduce.json").read_text(encoding="utf-8"))
    assert all(part in page for part in page_parts(published).values())
