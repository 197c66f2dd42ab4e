"""The same sweep on a Dask cluster, one of whose two machines is lost in the middle."""

import json
import subprocess
import sys
import time

import pytest

pytest.importorskip("distributed")
from tests.training.sweeps import TASKS, finished, sweep, sweep_process, write_policy

pytestmark = [pytest.mark.training, pytest.mark.slow]


def dask(*arguments):
    """A process of the cluster."""
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *map(str, arguments), "--no-dashboard"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


@pytest.fixture
def cluster(tmp_path):
    """Address of a scheduler, and its two worker processes; nobody starts a lost one again."""
    file = tmp_path / "scheduler.json"
    scheduler = dask("scheduler", "--port", 0, "--host", "127.0.0.1", "--scheduler-file", file)
    workers = [dask("worker", "--scheduler-file", file, "--nthreads", 1, "--no-nanny") for _ in range(2)]
    while not file.exists():
        time.sleep(0.05)
    yield json.loads(file.read_text())["address"], workers
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


def test_a_lost_worker_changes_nothing(cluster, tmp_path):
    address, workers = cluster
    policy = write_policy(tmp_path / "policy")
    chosen = ("--controllers", f"P={policy}")
    alone = sweep(tmp_path / "alone", *chosen, "--workers", 1)
    out = tmp_path / "together"
    process = sweep_process(out, *chosen, "--cluster", address)
    while not finished(out) and process.poll() is None:
        time.sleep(0.02)
    workers[0].kill()
    in_the_middle = len(finished(out)) < TASKS
    try:
        _, errors = process.communicate(timeout=600)
    finally:
        process.kill()
    assert in_the_middle
    assert process.returncode == 0, errors
    assert (out / "results.json").read_bytes() == alone
    spent = json.loads((out / "cost.json").read_text())
    assert spent["tasks_handed_out_by"] == "Dask"


def test_an_address_where_nobody_answers_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("training.studies.parallel_run.CLUSTER_TIMEOUT", 1)
    with pytest.raises(ValueError, match=r"no Dask scheduler answers at tcp://127.0.0.1:9"):
        sweep(tmp_path, "--cluster", "tcp://127.0.0.1:9")
