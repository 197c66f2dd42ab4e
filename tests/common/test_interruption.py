"""Ctrl-C and SIGTERM end a command and its workers within seconds, with one sentence."""

import os
import signal
import subprocess
import sys

import pytest

pytest.importorskip("joblib")

COMMAND = """
import os, sys, time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from joblib import Parallel, delayed
from epv_env.common.command_line import fail_clearly

def work(path):
    open(os.path.join(path, str(os.getpid())), "w").close()
    time.sleep(60)

def with_joblib():
    pool = Parallel(n_jobs=2, return_as="generator_unordered")
    return len(list(pool(delayed(work)(sys.argv[2]) for _ in range(4))))

def with_futures():
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        return len(list(pool.map(work, [sys.argv[2]] * 4)))

if __name__ == "__main__":
    sys.exit(fail_clearly({"joblib": with_joblib, "futures": with_futures}[sys.argv[1]]))
"""


def alive(pid: int) -> bool:
    """Whether a process still runs; one that only waits to be counted does not."""
    try:
        with open(f"/proc/{pid}/stat") as stream:
            return stream.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="counts processes as Linux shows them")
@pytest.mark.parametrize(("pool", "number"), [("joblib", signal.SIGTERM), ("futures", signal.SIGINT)])
def test_a_stopped_command_leaves_no_worker_and_no_traceback(pool, number, tmp_path):
    script, started = tmp_path / "command.py", tmp_path / "started"
    script.write_text(COMMAND)
    started.mkdir()
    with subprocess.Popen(
        [sys.executable, str(script), pool, str(started)],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    ) as process:  # fmt: skip
        while len(list(started.iterdir())) < 2:
            assert process.poll() is None
        # A terminal sends Ctrl-C to the workers, too; the system sends SIGTERM to one process.
        (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    assert errors == "interrupted: what was finished is kept\n"
    assert not [path.name for path in started.iterdir() if alive(int(path.name))]
