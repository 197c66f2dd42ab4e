"""What an installation with one extra alone promises works: other packages cannot be imported here."""

import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OWN = ("epv_env", "controllers", "identification", "training", "tests", "docs")


def modules(*packages: str, needing: tuple[str, ...] = ()) -> str:
    """Code that imports every module of the packages, but those `needing` an extra."""
    return f"""
import importlib, pkgutil
for name in {packages}:
    package = importlib.import_module(name)
    for module in pkgutil.walk_packages(getattr(package, "__path__", []), name + "."):
        if not module.name.endswith(("__main__", *{needing})):
            importlib.import_module(module.name)
"""


def readme(k: int) -> str:
    """A Python example of README.md."""
    return (ROOT / "README.md").read_text(encoding="utf-8").split("```python\n")[k + 1].split("```")[0]


PROMISES = {
    "": modules("epv_env", "controllers", "training.epv", needing=(".sb3", ".pwm_design"))
    + readme(1)
    + readme(2),
    "render": readme(0) + modules("epv_env.render"),
    "control": "from controllers.tuned import tuned; tuned('PWM')",
    "training": modules("training"),
    "identification": modules("identification") + "import tqdm, jinja2",  # imported late
    "bench-files": modules("identification.importing", "identification.commands.import_")
    + "import asammdf, h5py, nptdms, pint, pyarrow, pymatreader",
    "video": "import epv_env, gymnasium as g\ne = g.make('EPValve-v0', render_mode='rgb_array')\n"
    "e.reset(); assert e.render().shape == (720, 1280, 3)",
    "docs": "import material, mkdocs, mkdocstrings\nfrom docs.scripts import hooks, unit_brackets\n"
    "for write in hooks.GENERATED.values(): write()",
}
"""What README.md and the guides say of an extra, as code; "": of an installation without extras."""


def closure(requirements: list[str], extras: frozenset[str] = frozenset()) -> set[str]:
    """Names of all distributions that these requirements bring, those that are installed here."""
    found: set[str] = set()
    waiting = [(text, extras) for text in requirements]
    while waiting:
        requirement, chosen = Requirement(waiting[-1][0]), waiting.pop()[1]
        name = canonicalize_name(requirement.name)
        wanted = requirement.marker is None or any(
            requirement.marker.evaluate({"extra": extra}) for extra in chosen or {""}
        )
        if not wanted or name in found:
            continue
        found.add(name)
        try:
            waiting += [(text, frozenset(requirement.extras)) for text in requires(name) or []]
        except PackageNotFoundError:
            continue
    return found


def blocker(*extras: str) -> str:
    """Code after which only what an installation with these extras brings can be imported."""
    optional = PROJECT["optional-dependencies"]
    asked = [*PROJECT["dependencies"], *(line for extra in extras for line in optional[extra])]
    allowed = closure(asked)
    blocked = {
        module
        for module, names in packages_distributions().items()
        if module not in OWN and not allowed & {canonicalize_name(name) for name in names}
    }
    return f"""
import sys
from importlib.machinery import PathFinder
class Brought(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in {blocked} else super().find_spec(name, path, target)
sys.meta_path = [Brought if finder is PathFinder else finder for finder in sys.meta_path]
"""


@pytest.mark.parametrize("extra", PROMISES)
def test_an_extra_alone_brings_what_it_promises(extra, tmp_path):
    code = blocker(*filter(None, [extra])) + PROMISES[extra]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "SDL_VIDEODRIVER": "dummy"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-1500:]


def test_training_installs_only_its_extras_all_of_them_pinned():
    """What `make train` and `make test` ask of pip from an empty clone."""

    def steps(target: str) -> str:
        words = ["make", "-nB", target]
        return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    assert "-r requirements.lock" in steps("test")
    assert "-r requirements.lock" not in steps("train")
    found = re.search(r"-c requirements\.lock -e '\.\[([\w,]+)\]'", steps("train"))
    assert found is not None
    extras = PROJECT["optional-dependencies"]
    brought = closure(
        [*PROJECT["dependencies"], *(line for extra in found[1].split(",") for line in extras[extra])]
    )
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    (constraints,) = re.findall(r"^-c (.*)$", lock, re.M)
    lock += (ROOT / constraints).read_text(encoding="utf-8")
    pinned = {canonicalize_name(name) for name in re.findall(r"^([\w.-]+)==", lock, re.M)}
    installed = {canonicalize_name(n) for names in packages_distributions().values() for n in names}
    assert len(brought) > 20
    assert brought & installed <= pinned


def test_pictures_and_films_can_be_installed_together():
    """MoviePy 2.2 wants a Pillow below 12."""
    extra = map(Requirement, PROJECT["optional-dependencies"]["render"])
    assert any(each.name == "pillow" and "11.3" in each.specifier for each in extra)
