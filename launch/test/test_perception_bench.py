# SPDX-License-Identifier: BSD-3-Clause
"""What the nodes' latency.json becomes in the table of `./fabric bench perception`."""

import pytest

from fabric_bringup import perception_bench as bench


def found(rate: float, p95: float, head_core: float) -> dict:
    latency = {"told": 300, "p50": 20.0, "p95": p95, "p99": 70.0, "most": 90.0}
    cores = {"tracking": 20.0, "gesture": 2.0, "head": head_core}
    told = {"human/activity": latency, "human/head": latency}
    return {"rate_hz": rate, "pictures": 300, "load": 0.5, "core_percent": cores, **told}


def test_the_activity_is_judged_and_the_head_is_told():
    activity, head, _ = bench.figures(found(10.0, 61.0, 10.0))
    assert (activity["value"], activity["target"], activity["met"]) == (61.0, 60.0, False)
    assert (activity["p50"], activity["p99"], activity["told"]) == (20.0, 70.0, 300)
    assert "human/activity" in activity["detail"]
    assert "10 Hz" in activity["detail"]
    assert "met" not in head


def test_the_cores_of_all_nodes_are_added_and_judged_at_the_higher_rate():
    *_, slow = bench.figures(found(10.0, 30.0, 10.0))
    *_, fast = bench.figures(found(30.0, 30.0, 27.0))
    assert slow["value"] == pytest.approx(32.0)
    assert "met" not in slow
    assert (fast["value"], fast["met"]) == (pytest.approx(49.0), True)
    assert fast["head_percent"] == 27.0
