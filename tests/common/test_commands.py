"""A command is a module: it is found, listed, parsed and run alone; wrong input is one sentence."""

import importlib
import os
import signal
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pytest

from epv_env.common.commands import commands, main, main_of
from epv_env.common.compilation import Announcer
from epv_env.common.results_folder import only_writer

GREET = '''"""Write a greeting.

More about it.
"""

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from epv_env.common.options import Folder, Quick

QUICK = {"times": 1}


@dataclass(frozen=True)
class Options:
    greeting: Annotated[str, "a word"] = "hello"
    _: KW_ONLY
    out: Folder
    times: Annotated[int, "how often"] = 3
    quick: Quick = False


def run(options):
    if options.times < 1:
        raise ValueError("--times must be positive")
    (options.out / "greeting.txt").write_text(f"{options.greeting} " * options.times)


def next_step(options):
    return None
'''


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "greeting_commands"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "say_hello_.py").write_text(GREET)
    monkeypatch.syspath_prepend(tmp_path)
    yield "greeting_commands"
    for name in [name for name in sys.modules if name.startswith("greeting_commands")]:
        del sys.modules[name]


def test_a_file_is_a_command_and_its_docstring_the_help(package, capsys):
    assert commands([package]) == {"say-hello": "greeting_commands.say_hello_"}
    assert main([package], program="epv", arguments=[]) == 0
    assert "  say-hello  Write a greeting.\n" in capsys.readouterr().out


def test_a_command_runs_with_its_options(package, tmp_path):
    out = tmp_path / "results"
    assert main([package], program="epv", arguments=["say-hello", "--out", str(out)]) == 0
    assert (out / "greeting.txt").read_text() == "hello hello hello "
    module = "greeting_commands.say_hello_"
    assert main_of(module, program="greet", arguments=["bye", "--quick", "--out", str(out)]) == 0
    assert (out / "greeting.txt").read_text() == "bye "


def test_wrong_input_is_one_sentence(package, tmp_path, capsys):
    arguments = ["say-hello", "--out", str(tmp_path / "none"), "--times", "0"]
    assert main([package], program="epv", arguments=arguments) == 2
    assert capsys.readouterr().err == "error: --times must be positive\n"
    assert not (tmp_path / "none").exists()
    assert main([package], program="epv", arguments=["say-hallo"]) == 2
    assert "no command 'say-hallo': did you mean 'say-hello'?" in capsys.readouterr().err


def test_what_a_killed_writer_left_goes_with_the_next_one(tmp_path):
    """A kill between writing and renaming leaves the new content under a hidden name."""
    for name in (
        ".report.json.0123abcd",
        ".export.0123abcd/.epv_policy.c.0123abcd",
        "kept.0123abcd",
        ".hidden",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / ".link.0123abcd").symlink_to(tmp_path.parent)  # what it points to stays
    with only_writer(tmp_path):
        assert {path.name for path in tmp_path.iterdir()} == {"kept.0123abcd", ".hidden", ".lock"}


def test_a_lock_that_is_a_link_out_of_the_folder_is_not_followed(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "precious").write_text("kept")
    (tmp_path / "out" / ".lock").symlink_to(tmp_path / "precious")
    with pytest.raises(OSError, match=r"\.lock"), only_writer(tmp_path / "out"):
        pass
    assert (tmp_path / "precious").read_text() == "kept"


def test_a_missing_package_is_named_with_its_extra(package, tmp_path, capsys):
    (tmp_path / package / "needs.py").write_text(
        f'"""Need torch."""\nraise ModuleNotFoundError("none", name="torch")\n{GREET}'
    )
    assert main([package], program="epv", arguments=["needs"]) == 2
    assert "epv needs: this needs the package torch" in capsys.readouterr().err


HOLD = (
    "import sys, time; from pathlib import Path; from epv_env.common.results_folder import only_writer\n"
)
HOLD += "with only_writer(Path(sys.argv[1])): print('held', flush=True); time.sleep(60)"


def test_a_second_process_is_refused_until_the_first_is_dead(tmp_path):
    folder = tmp_path / "out"
    with subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE) as first:
        assert first.stdout is not None
        first.stdout.readline()
        with pytest.raises(ValueError, match="another process writes into"), only_writer(folder):
            pass
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
    with only_writer(folder):
        pass


def test_nothing_stays_of_a_start_that_failed(tmp_path):
    with pytest.raises(OSError, match="no"), only_writer(tmp_path / "a" / "b"):
        raise OSError("no")
    assert not list(tmp_path.iterdir())


def test_what_a_cache_will_hold_is_announced_once_and_counted(capsys, monkeypatch):
    """A module None is that of code made from text."""
    announcer = Announcer()

    def compile_in(module: str | None, kept: str | None) -> str:
        stats = SimpleNamespace(cache_path=kept)
        event = SimpleNamespace(data={"dispatcher": SimpleNamespace(__module__=module, stats=stats)})
        inner = SimpleNamespace(data={"dispatcher": SimpleNamespace(__module__=None, stats=stats)})
        for given in (event, inner):
            announcer.on_start(given)
        for given in (inner, event):
            announcer.on_end(given)
        return capsys.readouterr().err

    for module, kept in ((None, "/c"), ("scipy.a", "/c"), ("epv_env.a", None)):
        assert compile_in(module, kept) == ""
    assert compile_in("epv_env.a", "/c") == "compiling for this machine: up to a minute, once\n"
    assert compile_in("epv_env.b", "/c") == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert compile_in("epv_env.c", "/c") == "\r5 functions compiled\r6 functions compiled\n"


def test_the_version_is_that_of_the_package(package, capsys):
    assert main([package], program="epv", arguments=["--version"]) == 0
    assert capsys.readouterr().out == f"epv {version('epv-valve')}\n"


def test_the_entry_points_of_the_package_exist():
    """What pip installs as a command is a function of this code."""
    pyproject = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))
    for target in pyproject["project"]["scripts"].values():
        module, _, name = target.partition(":")
        assert callable(getattr(importlib.import_module(module), name))
