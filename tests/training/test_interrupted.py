"""Commands on a full disk, and killed at one of their files and repeated."""

import errno
import os
import shutil
from pathlib import Path

import pytest

pytest.importorskip("torch")

from epv_env.common.commands import main
from training.epv import PACKAGES

LOG = "log --controller hysteresis --drives 2 --duration 10 --out {}"
COMMANDS = {
    "log": LOG,
    "export": "export plant --compiler= --out {}",
    "sweep": "sweep --quick --workers 1 --out {}",
    "train": "train --quick --out {}",
    "sim-to-real": "sim-to-real --quick --out {}",
    "run": "run {campaign} --stage quality --out {}",
    "gap": "gap {log} --logs --out {}",
}


def epv(words: str) -> int:
    """Run a command."""
    return main(PACKAGES, program="epv", arguments=words.split())


@pytest.fixture(scope="module")
def given(tmp_path_factory) -> dict[str, Path]:
    """What the commands read."""
    folder = tmp_path_factory.mktemp("given")
    assert epv(LOG.format(folder / "log")) == 0
    assert epv(f"bench --out {folder / 'campaign'}") == 0
    return {name: folder / name for name in ("log", "campaign")}


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_disk_is_named_with_the_path(command, given, tmp_path, monkeypatch, capsys):
    replace = os.replace

    def full(source: Path, target: Path) -> None:
        if tmp_path in Path(target).parents:  # numba's cache lies elsewhere
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    assert epv(COMMANDS[command].format(tmp_path / "out", **given)) == 2
    said = capsys.readouterr().err
    assert "cannot write: No space left on device" in said
    assert str(tmp_path / "out") in said
    assert not [name for name in contents(tmp_path) if "/." in f"/{name}"]


class Killed(BaseException):
    """Stands for a signal that no command can catch."""


def test_what_is_killed_at_each_file_ends_as_undisturbed(given, tmp_path, monkeypatch):
    words, out = COMMANDS["sweep"].format(tmp_path / "out", **given), tmp_path / "out"
    assert epv(words) == 0
    undisturbed = contents(out)
    shutil.rmtree(out)
    replace, begun = os.replace, set()

    def keep(path: Path, missing_ok: bool = False) -> None:
        raise OSError("a killed command tidies nothing up")

    def run() -> bool:
        """Whether the command ends; it is killed where it first writes a file."""
        with monkeypatch.context() as patch:

            def kill(source: Path, target: Path) -> None:
                if out in Path(target).parents and target not in begun:
                    begun.add(target)
                    patch.setattr(Path, "unlink", keep)
                    raise Killed
                replace(source, target)

            patch.setattr(os, "replace", kill)
            try:
                assert epv(words) == 0
            except Killed:
                assert any("/." in f"/{name}" for name in contents(out))
                return False
        return True

    while not run():
        pass
    assert {str(path.relative_to(out)) for path in map(Path, begun)} >= set(undisturbed)
    assert contents(out) == undisturbed
