"""Finished pieces of long work, kept line by line, so that an interrupted run goes on where it was."""

import json
from pathlib import Path
from typing import Any

from epv_env.common.files import write_text


class Journal:
    """Results by name in a JSON Lines file whose first line says what they belong to."""

    def __init__(self, path: Path, subject: dict[str, Any]):
        """subject: everything that the results depend on. A journal of another subject starts anew."""
        self.path = path
        self._found: dict[str, Any] = {}
        header = json.dumps({"subject": subject}, sort_keys=True) + "\n"
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        complete = text[: text.rfind("\n") + 1]  # the last line of a killed run may be torn
        kept = complete if complete.startswith(header) else header
        for line in kept.splitlines()[1:]:
            entry = json.loads(line)
            self._found[entry["name"]] = entry["result"]
        if kept != text:
            write_text(path, kept)

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
