# SPDX-License-Identifier: BSD-3-Clause
"""What a measured figure is, and how time is measured: CPU time, medians."""

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

Figure = dict[str, object]


def figure(
    name: str,
    model: str,
    value: float | None,
    unit: str,
    *,
    at_most: float | None = None,
    at_least: float | None = None,
    reference: float | None = None,
    **more: object,
) -> Figure:
    """One figure: `target` and `met` from the limit given, if any; `reference` is what others
    measured; `more` follows as it is. How far a target was missed is told in standard errors, too,
    where there are any."""
    target, sense = (at_most, "<=") if at_most is not None else (at_least, ">=")
    result: Figure = {
        "bench": "planner", "figure": name, "model": model, "value": value, "unit": unit,
    }  # fmt: skip
    if target is not None:
        met = value is not None and (value <= target if sense == "<=" else value >= target)
        result |= {"target": target, "sense": sense, "met": met}
        error = more.get("standard_error")
        if not met and value is not None and error:
            result["missed_by_errors"] = abs(value - target) / error
    if reference is not None:
        result["reference"] = reference
    return result | more


def beside(result: Figure, baseline: str, value: float) -> Figure:
    """The figure with the plain way of doing it, measured in the same run and unit."""
    own = result["value"]
    ratio = value / own if own else None
    return result | {"baseline": baseline, "baseline_value": value, "baseline_over_ours": ratio}


def cpu_seconds(call: Callable[[], object]) -> float:
    """CPU time of this thread for one call."""
    begin = time.thread_time()
    call()
    return time.thread_time() - begin


def median_cpu(call: Callable[[], object], repeats: int) -> float:
    """Median CPU time of one call, in seconds."""
    return statistics.median(cpu_seconds(call) for _ in range(repeats))


def hardware() -> Figure:
    """The first line: on what all that follows was measured."""
    return {
        "bench": "planner", "figure": "hardware", "cpu": _processor(),
        "cores": len(os.sched_getaffinity(0)), "memory_mb": _memory_mb(),
        "load": round(os.getloadavg()[0], 2), "time": "CPU time of the thread, medians",
    }  # fmt: skip


def _processor() -> str:
    for line in _lines("/proc/cpuinfo"):
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return "unknown"


def _memory_mb() -> int | None:
    for line in _lines("/proc/meminfo"):
        if line.startswith("MemTotal"):
            return int(line.split()[1]) // 1024
    return None


def _lines(path: str) -> list[str]:
    file = Path(path)
    return file.read_text().splitlines() if file.exists() else []
