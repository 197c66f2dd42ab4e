"""Finished pieces of long work, kept line by line, so that an interrupted run goes on where it was."""

import json
from pathlib import Path
from typing import Any

from epv_env.common.files import read_bytes, write_bytes


class Journal:
    """Results by name in a JSON Lines file whose first line says what they belong to."""

    def __init__(self, path: Path, subject: dict[str, Any]):
        """subject: everything that the results depend on. A journal of another subject starts anew.

        Raises ValueError if a line is damaged, OSError if the file is no regular one.
        """
        self.path = path
        self._found: dict[str, Any] = {}
        header = json.dumps({"subject": subject}, sort_keys=True) + "\n"
        content = read_bytes(path) if path.exists() else b""
        complete = content[: content.rfind(b"\n") + 1]  # the last line of a killed run may be torn
        kept = complete if complete.startswith(header.encode()) else header.encode()
        for number, line in enumerate(kept.split(b"\n")[1:-1], start=2):
            name, result = self._entry(line, number)
            self._found[name] = result
        if kept != content:
            write_bytes(path, kept)

    def _entry(self, line: bytes, number: int) -> tuple[str, Any]:
        """Name and result in a line of the file. Raises ValueError if it is damaged."""
        try:
            entry = json.loads(line)
            if isinstance(entry["name"], str):
                return entry["name"], entry["result"]
        except (ValueError, KeyError, TypeError, RecursionError):
            pass
        raise ValueError(
            f"{self.path}, line {number} is damaged: remove this line, and its result is computed again"
        )

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
