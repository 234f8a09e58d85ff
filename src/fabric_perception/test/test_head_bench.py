# SPDX-License-Identifier: BSD-3-Clause
"""What the bench of the head tracker says."""

import numpy as np
from head_scene import HELMET, degrees_apart

from fabric_perception.head import bench
from fabric_perception.head.tracker import HeadTracker


def test_the_stream_is_of_a_head_that_moves_and_the_same_for_a_seed():
    first, again = (bench.stream(HELMET, 4, 103) for _ in range(2))
    assert all(np.array_equal(a.grey, b.grey) for a, b in zip(first, again, strict=True))
    assert degrees_apart(first[0].yaw, first[3].yaw) > 1.0
    seen = HeadTracker(bench.head_camera(), HELMET).step(first[0].t, first[0].grey)
    assert degrees_apart(seen.yaw, first[0].yaw) < 2.0


def test_every_figure_is_there_and_the_accuracy_is_that_of_the_tracker():
    told = bench.measure(HELMET, pictures=6, rounds=1)
    assert told["visible"] == 1.0
    assert told["yaw_rmse_deg"] <= told["yaw_max_deg"] < 2.0
    for name in ("head_ms", "search_ms", "opencv_ms", "opencv_april_ms"):
        assert told[name] > 0.0
    assert told["ratio"] == told["head_ms"] / told["opencv_ms"]
