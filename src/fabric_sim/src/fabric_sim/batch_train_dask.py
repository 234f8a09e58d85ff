# SPDX-License-Identifier: BSD-3-Clause
"""The jobs of a training on a Dask cluster, whose workers need the sourced workspace only.

    dask-scheduler
    dask-worker ADDRESS          # on each machine, in a shell with devel/setup.bash sourced
    ./fabric train --scheduler ADDRESS

A worker that dies loses nothing: the scheduler has its chunks run elsewhere, with the same result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from fabric_abps.train import MapJobs

TIMEOUT = 3.0  # s until a scheduler must have answered, and a worker must be there


class SchedulerError(ValueError):
    """The cluster cannot be used; the message names the address."""


def _hold(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return function


def _apply(function: Callable[[Any], Any], item: Any) -> Any:
    return function(item)


@contextmanager
def cluster(address: str) -> Iterator[MapJobs]:
    """A map over the workers of a scheduler (host:port or tcp://host:port), keeping the order.

        with cluster("10.0.0.5:8786") as map_jobs:
            results = list(map_jobs(function, items))

    Raises SchedulerError at once when nobody answers there or no worker has joined.
    """
    client = _client(address)

    def map_jobs(function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[Any]:
        held = client.submit(_hold, function, pure=False)  # sent once, not with every item
        futures = [client.submit(_apply, held, item, pure=False) for item in items]
        try:
            for future in futures:
                yield _result(future, address)
                future.release()
        finally:
            with suppress(Exception):  # as in _close
                client.cancel(futures)

    try:
        yield map_jobs
    finally:
        _close(client)


def _result(future: Any, address: str) -> Any:
    from distributed import CancelledError
    from distributed.comm import CommClosedError
    from distributed.scheduler import KilledWorker

    try:
        return future.result()
    except (CancelledError, CommClosedError, KilledWorker) as error:
        raise SchedulerError(
            f"scheduler {address} lost the work ({type(error).__name__}); the same words go on "
            "from here"
        ) from error


def _client(address: str) -> Any:
    from distributed import Client

    try:
        client = Client(address, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SchedulerError(f"scheduler {address} does not answer: {error}") from error
    try:
        client.wait_for_workers(1, timeout=TIMEOUT)
    except (OSError, TimeoutError) as error:
        _close(client)
        raise SchedulerError(f"scheduler {address} has no worker: start dask-worker") from error
    return client


def _close(client: Any) -> None:
    with suppress(Exception):  # the scheduler may be gone, which changes nothing any more
        client.close(timeout=TIMEOUT)
