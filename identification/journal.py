"""Finished pieces of long work, kept line by line, so that an interrupted run goes on where it was."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any


class Journal:
    """Results by name in a JSON Lines file whose first line says what they belong to."""

    def __init__(self, path: Path, subject: dict[str, Any]):
        """subject: everything that the results depend on. A journal of another subject starts anew."""
        self.path = path
        self._found: dict[str, Any] = {}
        header = json.dumps({"subject": subject}, sort_keys=True)
        lines = _complete_lines(path)
        if next(lines, None) == header:
            for line in lines:
                entry = json.loads(line)
                self._found[entry["name"]] = entry["result"]
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(header + "\n", encoding="utf-8")

    def __contains__(self, name: str) -> bool:
        return name in self._found

    def __getitem__(self, name: str) -> Any:
        return self._found[name]

    def __len__(self) -> int:
        return len(self._found)

    def add(self, name: str, result: Any) -> None:
        """Keep a result, JSON-ready; it is on the disk when this returns."""
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps({"name": name, "result": result}) + "\n")
        self._found[name] = result


def _complete_lines(path: Path) -> Iterator[str]:
    """Lines of the file that end; the last one of a killed run may not."""
    if not path.exists():
        return
    for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
        if line.endswith("\n"):
            yield line[:-1]
