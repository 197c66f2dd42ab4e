"""Imports point one way: plant <- env <- controllers, training; plant <- identification."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEAVY = ("torch", "stable_baselines3", "matplotlib", "pygame", "pandas")

FORBIDDEN = {
    "epv_env/common": (
        "epv_env", "gymnasium", "controllers", "training", "identification", "torch", "pandas",
    ),
    "epv_env/plant": (
        "epv_env", "gymnasium", "controllers", "training", "identification", *HEAVY,
    ),
    "epv_env": ("controllers", "training", "identification"),
    "controllers": ("training",),
    "identification": ("controllers", "training"),
}  # fmt: skip
"""What the files of a folder do not import."""

ALLOWED = {"epv_env/common": ("epv_env.common",), "epv_env/plant": ("epv_env.plant", "epv_env.common")}
"""What they may import all the same."""


def imported(source: str, package: str) -> set[str]:
    """Absolute names of all modules that a file of a package imports, wherever in the file."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: len(package.split(".")) + 1 - node.level]
            module = ".".join([*(parents if node.level else []), *filter(None, [node.module])])
            names |= {f"{module}.{alias.name}" for alias in node.names}
    return names


def belongs(name: str, packages: tuple[str, ...]) -> bool:
    """Whether a module lies in one of the packages."""
    return any(f"{name}.".startswith(f"{package}.") for package in packages)


def offences(folder: str) -> list[str]:
    """Imports of a folder's files that point the wrong way."""
    found = []
    for path in sorted((ROOT / folder).rglob("*.py")):
        package = ".".join(path.relative_to(ROOT).parent.parts)
        for name in sorted(imported(path.read_text(encoding="utf-8"), package)):
            if belongs(name, FORBIDDEN[folder]) and not belongs(name, ALLOWED.get(folder, ())):
                found.append(f"{path.relative_to(ROOT)} imports {name}")
    return found


@pytest.mark.parametrize("folder", FORBIDDEN)
def test_imports_point_one_way(folder):
    assert offences(folder) == []


def test_only_the_adaptor_knows_stable_baselines3_and_torch():
    files = [path for path in (ROOT / "epv_env").rglob("*.py") if path.name != "sb3.py"]
    assert len(files) > 20
    for path in files:
        names = imported(path.read_text(encoding="utf-8"), "epv_env")
        assert not any(belongs(name, ("torch", "stable_baselines3")) for name in names), path


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


@pytest.mark.parametrize("module", ["epv_env.render", "epv_env.env", "epv_env.vector_env"])
def test_importing_the_environments_imports_nothing_heavy(module):
    code = f"import sys, {module}; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120,
        check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "[]"
