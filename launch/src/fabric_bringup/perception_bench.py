# SPDX-License-Identifier: BSD-3-Clause
"""Measures perception: `./fabric bench perception [--quick] [--json]`.

The stages on their own, CPU time beside plain OpenCV (`fabric_sim.batch_bench_perception`); then
the nodes as `perception.launch` starts them, in real time: rendered pictures of a sorting task are
sent at 10 and at 30 Hz, and it is measured when the activity of their stamps comes.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from fabric_bringup import launcher
from fabric_planner.bench_record import Figure, figure
from fabric_sim import batch_bench_perception as stages

RATES = (10.0, 30.0)  # Hz
FILM, QUICK_FILM = 45, 10  # pictures, sent forth and back
SECONDS, QUICK_SECONDS = 30.0, 5.0  # measured at each rate
LATENCY, SHARE = stages.LATENCY, stages.SHARE  # ms, p95; % of a core at the higher rate


def write_bag(path: Path, setup: stages.Setup, frames: Sequence[Any]) -> None:
    """Write rendered frames with calibrations and places of their cameras; one every 1/30 s."""
    import genpy
    import rosbag
    from tf2_msgs.msg import TFMessage

    from fabric_sim.camera import messages

    eye, head = setup.parameters.cell, setup.parameters.head
    first = genpy.Time(1)
    with rosbag.Bag(str(path), "w") as bag:
        bag.write("/tf_static", TFMessage([messages.place_of(lens) for lens in (eye, head)]), first)
        bag.write("cell/camera/rgb/camera_info", messages.camera_info(first, eye), first)
        bag.write("head/camera/camera_info", messages.camera_info(first, head), first)
        for number, frame in enumerate(frames):
            t = first + genpy.Duration.from_sec(number / stages.RATE)
            for topic, lens, picture in (
                ("cell/camera/rgb/image_raw", eye, frame.rgb),
                ("cell/camera/depth/image", eye, frame.depth),
                ("head/camera/image_raw", head, frame.head),
            ):
                bag.write(topic, messages.image(t, lens, picture), t)


def measure(quick: bool) -> Iterator[Figure]:
    """All figures of the nodes. Raises RuntimeError when they do not answer."""
    setup = stages.Setup.load()
    with tempfile.TemporaryDirectory(prefix="fabric_bench_") as name:
        folder = Path(name)
        write_bag(folder / "film.bag", setup, stages.frames(setup, QUICK_FILM if quick else FILM))
        for rate in RATES:
            yield from figures(_run(folder, rate, QUICK_SECONDS if quick else SECONDS))


def figures(found: dict[str, Any]) -> Iterator[Figure]:
    """What latency.json says."""
    rate = found["rate_hz"]
    told = {"time": "real time", "load": found["load"], "pictures": found["pictures"]}
    for topic in ("human/activity", "human/head"):
        latency = found[topic]
        more = {k: latency[k] for k in ("p50", "p99", "most", "told")} | told
        limit = LATENCY if topic == "human/activity" else None
        yield _figure(
            "latency", latency["p95"], "ms", limit, f"picture to {topic}, p95 at {rate:g} Hz", more
        )
    cores = {f"{node}_percent": share for node, share in found["core_percent"].items()}
    limit = SHARE if rate == max(RATES) else None
    share = sum(found["core_percent"].values())
    detail = f"of one, all of the nodes, at {rate:g} Hz"
    yield _figure("core", share, "%", limit, detail, cores | told)


def _figure(
    name: str, value: float, unit: str, limit: float | None, detail: str, more: dict[str, Any]
) -> Figure:
    return figure(
        name, "640x480", value, unit, at_most=limit, detail=detail, **more, bench="perception"
    )


def _run(folder: Path, rate: float, seconds: float) -> dict[str, Any]:
    result = folder / "latency.json"
    result.unlink(missing_ok=True)
    words = [f"file:={folder / 'film.bag'}", f"out_dir:={folder}", f"rate:={rate}"]
    code = launcher.run("latency.launch", [*words, f"pictures:={round(rate * seconds)}"], folder)
    if code or not result.exists():
        raise RuntimeError(f"the nodes did not answer at {rate:g} Hz (exit code {code})")
    return json.loads(result.read_text(encoding="utf-8"))


def main(argv: Sequence[str] | None = None) -> int:
    """Measure; return the exit code."""
    return stages.main(argv, measure)


if __name__ == "__main__":
    sys.exit(main())
