"""The console command `epv`: every command by one name, and a missing package with its extra."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from epv_env.common.extras import missing_package
from training.console.command import COMMANDS, overview, run

ROOT = Path(__file__).parents[2]

WITHOUT = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {wanted!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
sys.argv = ["epv", *{arguments!r}]
from training.console.command import main
sys.exit(main())
"""
EXTRAS_ONLY = {"torch", "optuna", "pandas", "tqdm", "joblib", "statsmodels", "threadpoolctl", "control"}


def called_without(packages, *arguments):
    """`epv` in a process of its own that has none of these packages."""
    code = WITHOUT.format(wanted=set(packages), arguments=arguments)
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.parametrize(
    ("name", "extra"),
    [
        ("train", "training"),
        ("compare", "training"),
        ("run", "identification"),
        ("gap", "identification"),
    ],
)
def test_a_missing_package_is_named_with_the_extra_that_brings_it(name, extra):
    result = called_without(EXTRAS_ONLY, name, "--help")
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: epv {name}: this needs the package ")
    assert f"pip install 'epv-valve[{extra}]' (in a clone: pip install -e '.[{extra}]')" in result.stderr
    assert result.stderr.count("\n") == 1


def test_the_list_needs_no_extra():
    result = called_without({*EXTRAS_ONLY, "matplotlib", "safetensors"})
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == overview() + "\n"
    assert all(f"  {name} " in result.stdout for name in COMMANDS)


def test_a_package_that_no_extra_brings_is_no_users_fault():
    assert missing_package("no_such_module.part") is None
    assert "'epv-valve[training]'" in (missing_package("stable_baselines3.ppo") or "")


def test_an_unknown_command_is_refused_with_the_nearest():
    with pytest.raises(ValueError, match="no command 'trian': did you mean 'train'"):
        run(["trian"])
    with pytest.raises(ValueError, match="`epv` lists them"):
        run(["0"])


def test_a_script_names_a_missing_package_too(tmp_path):
    """Its imports fail before its `main` is called."""
    hook = WITHOUT.partition("sys.argv")[0].format(wanted=EXTRAS_ONLY)
    (tmp_path / "sitecustomize.py").write_text(hook)
    paths = os.pathsep.join([str(tmp_path), str(ROOT)])
    result = subprocess.run(
        [sys.executable, str(ROOT / "training" / "sweep.py"), "--help"],
        capture_output=True, text=True, timeout=120, check=False,
        env={**os.environ, "PYTHONPATH": paths},
    )  # fmt: skip
    assert result.returncode != 0
    assert result.stderr.startswith("error: this needs the package ")
    assert "pip install 'epv-valve[training]'" in result.stderr
    assert result.stderr.count("\n") == 1
