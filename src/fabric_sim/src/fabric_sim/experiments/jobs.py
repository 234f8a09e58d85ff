# SPDX-License-Identifier: BSD-3-Clause
"""Independent pieces of work over several processes, in order, with a progress bar."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from tqdm import tqdm


def run_jobs(work: Callable[[Any], Any], jobs: Sequence[Any], processes: int, title: str) -> list:
    """Return work(job) of every job; equal whatever `processes` is."""
    bar = {"total": len(jobs), "desc": title, "leave": False, "unit": "job"}
    if processes <= 1 or len(jobs) <= 1:
        return list(tqdm(map(work, jobs), **bar))
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(min(processes, len(jobs)), mp_context=fork) as pool:
        return list(tqdm(pool.map(work, jobs), **bar))
