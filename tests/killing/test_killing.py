"""Killed commands give the results of uninterrupted ones, and the tool that says so can say no."""

import os
import sys

import pytest

pytest.importorskip("joblib")
pytest.importorskip("statsmodels")
pytest.importorskip("torch")

from tests.killing.__main__ import main, outcome
from tests.killing.studies import STUDIES, Study

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(sys.platform == "win32", reason="kills a process group"),
]

TOY = """
import argparse, json, time
from pathlib import Path
from epv_env.common.files import Journal

parser = argparse.ArgumentParser()
parser.add_argument("--honest", action="store_true")
parser.add_argument("--out", type=Path)
chosen = parser.parse_args()
chosen.out.mkdir(exist_ok=True)
journal = Journal(chosen.out / "finished.jsonl", {})
found = len(journal)
for k in range(6):
    if str(k) not in journal:
        time.sleep(0.2)
        journal.add(str(k), k * k)
result = {"squares": [journal[str(k)] for k in range(6)], "seconds": time.perf_counter()}
if not chosen.honest:
    result["found"] = found
(chosen.out / "result.json").write_text(json.dumps(result))
"""


def toy(folder, *options):
    """A command that keeps what is finished; unless honest, its result tells that it was killed."""
    script = folder / "toy.py"
    script.write_text(TOY)
    return Study(name="toy", arguments=(str(script), *options), results=("result.json",))


def test_a_command_that_goes_on_where_it_was_is_found_good(tmp_path):
    found = outcome(toy(tmp_path, "--honest"), 4, 1, tmp_path)
    assert (found.kills, found.faults) == (4, 0)
    assert found.compared >= 1


def test_a_command_whose_result_tells_that_it_was_killed_is_found_bad(tmp_path, capsys):
    found = outcome(toy(tmp_path), 6, 1, tmp_path)
    assert found.faults >= 1
    assert "toy: result.json is another one" in capsys.readouterr().out


def test_every_command_that_is_killed_has_files_to_compare():
    assert [study.name for study in STUDIES] == ["sweep", "compare", "gap", "train"]
    assert all(study.results for study in STUDIES)
    assert all(os.path.exists(s.arguments[0]) for s in STUDIES if s.arguments[0] != "-m")


@pytest.mark.slow
def test_a_killed_sweep_gives_the_result_of_an_uninterrupted_one(capsys):
    assert main(["--only", "sweep", "--kills", "1"]) == 0
    assert "1 kills" in capsys.readouterr().out
