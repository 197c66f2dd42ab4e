"""The folders of the project depend on each other in one direction, without a loop."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

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


def folder_graph(root: Path) -> dict[str, set[str]]:
    """Folders that each folder imports from, as dotted names.

    A file beside folders of its own folder counts as a folder.
    """
    known = modules(root)
    parents = {name: ".".join(path.relative_to(root).parent.parts) for name, path in known.items()}
    with_folders = {parent.rpartition(".")[0] for parent in parents.values()}
    folder = {name: name if parent in with_folders else parent for name, parent in parents.items()}
    graph: dict[str, set[str]] = {}
    for name, path in known.items():
        targets = {folder[target] for target in imports(path, known)}
        graph.setdefault(folder[name], set()).update(targets - {folder[name]})
    return graph


def test_no_folder_imports_itself_by_a_detour():
    graph = folder_graph(ROOT)
    assert len(graph) > 15
    tuple(TopologicalSorter(graph).static_order())


def test_a_loop_of_folders_is_found(tmp_path):
    (tmp_path / "epv_env/plant").mkdir(parents=True)
    (tmp_path / "epv_env/task.py").write_text("from epv_env.plant.flow import KAPPA\n")
    (tmp_path / "epv_env/plant/flow.py").write_text("def late():\n    from epv_env import task\n")
    with pytest.raises(CycleError):
        tuple(TopologicalSorter(folder_graph(tmp_path)).static_order())


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
