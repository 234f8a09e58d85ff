# SPDX-License-Identifier: BSD-3-Clause
"""Training on a Dask cluster: a worker may die, the result is that of one process."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from training_helpers import words, write_library

from fabric_sim import batch_train
from fabric_sim.batch_train import spread, train_models
from fabric_sim.batch_train_dask import SchedulerError, cluster
from fabric_sim.batch_train_people import code_fingerprint

TYPES = ("0.1,0.2,0.3,0.4", "0.9,0.8,0.7,0.6", "0.5,0.5,0.2,0.9")
PATIENCE = 60.0  # s


@pytest.fixture(autouse=True)
def sources_are_read_anew() -> None:
    """As by the processes that a test starts, should somebody edit while the tests run."""
    code_fingerprint.cache_clear()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, stack: ExitStack, folder: Path) -> None:
        self._stack, self._folder = stack, folder
        self._processes: list[subprocess.Popen] = []
        port = free_port()
        self.address = f"127.0.0.1:{port}"
        self._start("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")

    def add_worker(self) -> subprocess.Popen:
        place = ["--local-directory", str(self._folder), "--host", "127.0.0.1"]
        options = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--death-timeout", "60"]
        return self._start("worker", f"tcp://{self.address}", *options, *place)

    def _start(self, what: str, *options: str) -> subprocess.Popen:
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options]
        log = self._stack.enter_context((self._folder / f"{what}.log").open("a"))
        process = subprocess.Popen(command, stdout=log, stderr=log, cwd=self._folder)
        self._stack.callback(self._stop, process)
        self._processes.append(process)
        return process

    def stop_all(self) -> None:
        """Stop scheduler and workers at once."""
        for process in self._processes:
            self._stop(process)

    def _stop(self, process: subprocess.Popen) -> None:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(10.0)
        process.kill()
        process.wait()


@pytest.fixture
def workers(tmp_path):
    with ExitStack() as stack:
        yield Cluster(stack, tmp_path)


def wait_for_workers(address: str, number: int) -> None:
    """Return once so many workers have joined."""
    from distributed import Client

    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        with suppress(OSError), Client(address, timeout=5.0, set_as_default=False) as client:
            if number:
                client.wait_for_workers(number, timeout=PATIENCE)
            return
    raise AssertionError(f"no scheduler at {address}")


def test_a_worker_killed_in_the_middle_changes_nothing(workers, tmp_path) -> None:
    library = write_library(tmp_path / "library")
    victim, _ = workers.add_worker(), workers.add_worker()
    wait_for_workers(workers.address, 2)
    killed_at = []

    def progress(done: int, total: int) -> None:
        if not killed_at and done >= total // 4:
            victim.kill()
            victim.wait()
            killed_at.append(done / total)

    remote, local = tmp_path / "remote.npz", tmp_path / "local.npz"
    with cluster(workers.address) as map_chunks:
        train_models(library, TYPES, 90, 101, map_chunks, progress, cache=remote)
    train_models(library, TYPES, 90, 101, spread(1), cache=local)
    assert killed_at and killed_at[0] < 0.8
    assert remote.read_bytes() == local.read_bytes()


def test_the_command_trains_on_a_cluster(workers, tmp_path) -> None:
    workers.add_worker()
    wait_for_workers(workers.address, 1)
    for root, scheduler in ((tmp_path / "a", workers.address), (tmp_path / "b", "")):
        write_library(root)
        assert batch_train.main(words(root, tasks=2, scheduler=scheduler)) == 0
    files = [tmp_path / name / "inspection/models.npz" for name in "ab"]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_scheduler_that_is_not_there_is_named_and_nothing_written(tmp_path, capsys) -> None:
    write_library(tmp_path)
    address = f"127.0.0.1:{free_port()}"
    assert batch_train.main(words(tmp_path, scheduler=address)) == 2
    assert f"scheduler {address} does not answer" in capsys.readouterr().err
    assert not (tmp_path / "inspection/models.npz").exists()


def test_a_scheduler_without_workers_is_refused(workers) -> None:
    wait_for_workers(workers.address, 0)
    with pytest.raises(SchedulerError, match=f"{workers.address} has no worker"):
        with cluster(workers.address):
            pass


def test_a_scheduler_that_goes_away_is_named(workers) -> None:
    workers.add_worker()
    wait_for_workers(workers.address, 1)
    with pytest.raises(SchedulerError, match=f"{workers.address} lost the work"):
        with cluster(workers.address) as map_jobs:
            for _ in map_jobs(str, list(range(200))):
                workers.stop_all()
