#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sends a bag's pictures in real time and measures how long perception takes to answer.

The pictures get stamps of now and go forth and back until there are enough; `latency.json` in
out_dir says how long after the first picture of a moment its answers came, and what the nodes cost.
"""

import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any, NamedTuple
from xmlrpc.client import ServerProxy

import rosbag
import rosgraph
import rospy
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

from fabric_msgs.msg import HeadState, HumanActivity
from fabric_perception.latency import Stopwatches, to_and_fro

PICTURES = ("cell/camera/rgb/image_raw", "cell/camera/depth/image", "head/camera/image_raw")
INFOS = ("cell/camera/rgb/camera_info", "head/camera/camera_info")
ANSWERS = {"human/activity": HumanActivity, "human/head": HeadState}
NODES = ("tracking", "gesture", "head")
WARM = 3.0  # s of pictures before the first that is measured
PARAMETERS = ("file", "out_dir", "rate", "pictures", "patience")


class Film(NamedTuple):
    """What a bag holds: the pictures of each moment in the order of PICTURES, and the rest."""

    moments: list[tuple[Any, ...]]
    infos: dict[str, Any]
    frames: TFMessage

    @classmethod
    def of(cls, path: Path) -> "Film":
        """Raises ValueError when there is no moment with all pictures."""
        by_stamp: dict[int, dict[str, Any]] = {}
        infos: dict[str, Any] = {}
        frames = TFMessage()
        with rosbag.Bag(str(path)) as bag:
            for topic, message, _ in bag.read_messages():
                name = topic.strip("/")
                if name in PICTURES:
                    by_stamp.setdefault(message.header.stamp.to_nsec(), {})[name] = message
                elif name in INFOS:
                    infos[name] = message
                elif name == "tf_static":
                    frames.transforms += message.transforms
        whole = [found for _, found in sorted(by_stamp.items()) if len(found) == len(PICTURES)]
        if not whole or len(infos) < len(INFOS):
            raise ValueError(f"{path}: no moment has all of {', '.join((*PICTURES, *INFOS))}")
        return cls([tuple(found[name] for name in PICTURES) for found in whole], infos, frames)


class Probe:
    """Publishes as a camera's driver does, and listens."""

    def __init__(self, film: Film, patience: float) -> None:
        """patience: s of wall time for the nodes to be there and to answer."""
        self._film, self._patience = film, patience
        self._watches = Stopwatches(tuple(ANSWERS))
        self._heard = threading.Condition()
        self._pictures = {name: rospy.Publisher(name, Image, queue_size=10) for name in PICTURES}
        self._fixed = [rospy.Publisher("/tf_static", TFMessage, latch=True, queue_size=1)]
        self._fixed[0].publish(film.frames)
        for name, info in film.infos.items():
            self._fixed.append(rospy.Publisher(name, CameraInfo, latch=True, queue_size=1))
            self._fixed[-1].publish(info)
        for name, kind in ANSWERS.items():
            rospy.Subscriber(name, kind, self._take, callback_args=name, tcp_nodelay=True)

    def run(self, rate: float, count: int) -> dict[str, Any]:
        """Measure so many pictures. Raises RuntimeError when nobody answers."""
        warm = round(WARM * rate)
        order = to_and_fro(warm + count, len(self._film.moments))
        self._wait(self._connected, "nobody takes the pictures")
        self._film_at(rate, order[:warm])
        last = self._send(order[warm])
        self._wait(lambda: self._watches.answered("human/head", last), "nobody answers")
        self._watches = Stopwatches(tuple(ANSWERS))
        before, began = _cpu_seconds(), time.monotonic()
        last = self._film_at(rate, order[warm:])
        self._wait(lambda: self._watches.answered("human/head", last), "nobody answers")
        wall = time.monotonic() - began
        used = {node: 100.0 * (s - before[node]) / wall for node, s in _cpu_seconds().items()}
        return {
            "rate_hz": rate,
            "pictures": count,
            "load": os.getloadavg()[0],
            "core_percent": used,
            **{name: self._watches.latency(name)._asdict() for name in ANSWERS},
        }

    def _film_at(self, rate: float, order: list[int]) -> int:
        """Send pictures at a rate; the last one's stamp."""
        ticks, stamp = rospy.Rate(rate), 0
        for index in order:
            stamp = self._send(index)
            ticks.sleep()
        return stamp

    def _send(self, index: int) -> int:
        stamp = rospy.Time.now()
        with self._heard:
            self._watches.sent(stamp.to_nsec(), time.monotonic())
        moment = self._film.moments[index]
        for publisher, picture in zip(self._pictures.values(), moment, strict=True):
            picture.header.stamp = stamp
            publisher.publish(picture)
        return stamp.to_nsec()

    def _take(self, message: Any, topic: str) -> None:
        now = time.monotonic()
        with self._heard:
            self._watches.told(topic, message.header.stamp.to_nsec(), now)
            self._heard.notify_all()

    def _connected(self) -> bool:
        return all(p.get_num_connections() for p in (*self._pictures.values(), *self._fixed))

    def _wait(self, reached: Any, complaint: str) -> None:
        end = time.monotonic() + self._patience
        with self._heard:
            while not reached():
                if rospy.is_shutdown() or time.monotonic() > end:
                    raise RuntimeError(f"{complaint} after {self._patience:g} s")
                self._heard.wait(0.1)


def _cpu_seconds() -> dict[str, float]:
    """CPU time of each node so far, all of it: receiving, thinking, sending; s."""
    master = rosgraph.Master(rospy.get_name())
    ticks = os.sysconf("SC_CLK_TCK")
    used = {}
    for node in NODES:
        _, _, pid = ServerProxy(master.lookupNode(rospy.resolve_name(node))).getPid(
            rospy.get_name()
        )
        values = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        used[node] = (int(values[11]) + int(values[12])) / ticks  # utime and stime, proc(5)
    return used


def main() -> None:
    """Measure once and write what was found."""
    rospy.init_node("latency")
    p = {name: rospy.get_param("~" + name) for name in PARAMETERS}
    try:
        probe = Probe(Film.of(Path(p["file"])), float(p["patience"]))
        found = probe.run(float(p["rate"]), int(p["pictures"]))
    except (ValueError, RuntimeError, OSError, rosbag.ROSBagException) as error:
        sys.exit(f"latency: {error}")
    partial = Path(p["out_dir"], "latency.json.part")
    partial.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, partial.with_suffix(""))


if __name__ == "__main__":
    main()
