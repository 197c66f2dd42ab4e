"""Two processes never write into one folder of results, and a lock does not outlive its process."""

import os
import signal
import subprocess
import sys

import pytest

pytest.importorskip("filelock")
from epv_env.common.results_folder import only_writer

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


def test_results_stay_and_the_lock_goes(tmp_path):
    with only_writer(tmp_path / "a"):
        (tmp_path / "a" / "result").write_text("42")
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["result"]
