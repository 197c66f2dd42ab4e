"""The diagnosis of a grey-box plant knows no valve."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("epv_env", "identification", "controllers", "training")
VALVE_FREE = (
    "epv_env.common",
    "identification.block_bootstrap",
    "identification.gap",
    "identification.readings_noise",
    "identification.report",
    "identification.report_2003",
)
"""Packages that know no valve: all that the diagnosis of a grey-box plant may rest on."""


def modules(root: Path) -> dict[str, Path]:
    """Files of the packages by the name under which they are imported."""
    found = {}
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(path: Path, known: dict[str, Path]) -> set[str]:
    """Modules of the packages that a file imports, wherever in the file it does so."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            submodules = {f"{node.module}.{alias.name}" for alias in node.names} & set(known)
            names |= submodules or {node.module}
    return names & set(known)


def test_the_diagnosis_imports_nothing_of_the_valve():
    """Followed through every import, the diagnosis reaches packages without a valve only."""
    known = modules(ROOT)
    reached = {name for name in known if name.startswith("identification.gap.")}
    assert len(reached) > 30
    waiting = list(reached)
    while waiting:
        new = imports(known[waiting.pop()], known) - reached
        reached |= new
        waiting += new
    assert not {
        name for name in reached if not f"{name}.".startswith(tuple(f"{p}." for p in VALVE_FREE))
    }
