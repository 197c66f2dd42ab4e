"""Imports point one way: as docs/architecture.md says, without a loop of folders, and nothing heavy."""

import ast
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("epv_env", "identification", "controllers", "training")
HEAVY = ("torch", "stable_baselines3", "matplotlib", "pygame", "pandas")


def imported(source: str, package: str) -> set[str]:
    """Absolute names of all that a file of a package imports, wherever in the file."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: len(package.split(".")) + 1 - node.level]
            module = ".".join([*(parents if node.level else []), *filter(None, [node.module])])
            names |= {f"{module}.{alias.name}" for alias in node.names}
    return names


def files(root: Path) -> dict[str, Path]:
    """Files of the packages by the name under which they are imported."""
    paths = [path for package in PACKAGES for path in sorted((root / package).rglob("*.py"))]
    names = [".".join(path.relative_to(root).with_suffix("").parts) for path in paths]
    return {name.removesuffix(".__init__"): path for name, path in zip(names, paths, strict=True)}


def imports(root: Path) -> dict[str, set[str]]:
    """What each file of the packages imports, by its name."""
    return {
        name: imported(path.read_text("utf-8"), ".".join(path.relative_to(root).parent.parts))
        for name, path in files(root).items()
    }


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("import training.train_ppo", "training.train_ppo"),
        ("from training import compare", "training.compare"),
        ("def late():\n    from epv_env.env import EPValveEnv", "epv_env.env.EPValveEnv"),
        ("from ..env import EPValveEnv", "epv_env.env.EPValveEnv"),
        ("from .. import env", "epv_env.env"),
        ("from . import flow", "epv_env.plant.flow"),
    ],
)
def test_the_reader_finds_every_form_of_import(source, name):
    assert imported(source, "epv_env.plant") == {name}


def nearest(name: str, groups) -> str | None:
    """The longest of these dotted names that holds a name."""
    return max((g for g in groups if f"{name}.".startswith(f"{g}.")), key=len, default=None)


def test_packages_import_what_the_page_of_the_architecture_says():
    """So the plant knows no environment, and the diagnosis of any plant knows no valve."""
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w.]+)` \|.*\| ([^|]*) \|$", page, re.M)
    allowed = {name: set(re.findall(r"`([\w.]+)`", may)) for name, may in rows}
    assert len(allowed) > 6
    for name, found in imports(ROOT).items():
        own = nearest(name, allowed)
        assert own is not None, name
        others = {nearest(each, allowed) for each in found} - {own, None}
        assert others <= allowed[own], f"{name} imports {others - allowed[own]}"


def test_only_the_adaptor_knows_stable_baselines3_and_torch_and_the_plant_no_environment():
    for name, found in imports(ROOT).items():
        tops = {each.partition(".")[0] for each in found}
        if name.startswith("epv_env.") and name != "epv_env.sb3":
            assert not tops & {"torch", "stable_baselines3"}, name
        if name.startswith(("epv_env.plant", "epv_env.common")):
            assert not tops & {"gymnasium", *HEAVY}, name


def folder_graph(root: Path) -> dict[str, set[str]]:
    """Folders that each folder imports from; a file beside folders of its folder counts as a folder."""
    known = files(root)
    parents = {name: ".".join(path.relative_to(root).parent.parts) for name, path in known.items()}
    with_folders = {parent.rpartition(".")[0] for parent in parents.values()}
    folder = {name: name if parent in with_folders else parent for name, parent in parents.items()}
    graph: dict[str, set[str]] = {}
    for name, found in imports(root).items():
        targets = {folder[own] for each in found if (own := nearest(each, known)) is not None}
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


def test_importing_the_environments_imports_nothing_heavy():
    code = "import sys, epv_env.render, epv_env.vector_env; print(*sys.modules)"
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=120, check=True)
    assert not set(HEAVY) & set(done.stdout.split())
