#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The cameras of the pretend cell as a node: scenes in, pictures out.

Renders in the main thread, to which the graphics context belongs. Scenes that come faster than
they can be drawn are passed over, all but the newest; with a cell that waits none is lost.
"""

import sys
import threading
from collections import deque
from typing import Any

import rospy
import tf2_ros
from sensor_msgs.msg import CameraInfo, Image

from fabric_msgs.msg import SimScene
from fabric_msgs.traffic import Traffic
from fabric_sim.camera import messages
from fabric_sim.camera.node_parameters import CameraNodeParameters
from fabric_sim.camera.parameters import TICK_RATE, CameraParameters, Lens
from fabric_sim.camera.renderer import CellRenderer

SCENE = "sim/scene"
COLOUR, DEPTH, HEAD = "cell/camera/rgb", "cell/camera/depth", "head/camera"
PICTURES = {
    COLOUR: "cell/camera/rgb/image_raw",
    DEPTH: "cell/camera/depth/image",
    HEAD: "head/camera/image_raw",
}
PATIENCE = 0.5  # s of wall time between looks at whether to end


class CameraNode:
    """Draws scenes as they come."""

    def __init__(self, renderer: CellRenderer, parameters: CameraParameters) -> None:
        self._renderer, self._parameters = renderer, parameters
        self._lenses = {COLOUR: parameters.cell, DEPTH: parameters.cell, HEAD: parameters.head}
        self._scenes: deque[SimScene] = deque()
        self._traffic = Traffic("camera")
        self._arrived = threading.Condition(self._traffic.lock)
        self._pictures = {
            name: self._traffic.publisher(topic, Image) for name, topic in PICTURES.items()
        }
        self._infos = {
            name: self._traffic.publisher(f"{name}/camera_info", CameraInfo, latch=True)
            for name in PICTURES
        }
        for name, lens in self._lenses.items():
            self._infos[name].publish(messages.camera_info(rospy.Time(), lens))
        self._frames = tf2_ros.StaticTransformBroadcaster()
        lenses = (parameters.cell, parameters.head)
        self._frames.sendTransform([messages.place_of(lens) for lens in lenses])
        self._traffic.declare_handled(SCENE)
        rospy.Subscriber(SCENE, SimScene, self._take, tcp_nodelay=True)

    def run(self) -> None:
        """Draw until shutdown."""
        while not rospy.is_shutdown():
            with self._arrived:
                if not self._scenes:
                    self._arrived.wait(PATIENCE)
                waiting = list(self._scenes)
                self._scenes.clear()
            self._work(waiting)

    def _take(self, scene: SimScene) -> None:
        with self._arrived:
            self._scenes.append(scene)
            self._arrived.notify()

    def _work(self, waiting: list[SimScene]) -> None:
        """Draw the newest scene that is due; all count as handled."""
        due = [scene for scene in waiting if self._due(scene)]
        if due:
            try:
                self._draw(due[-1])
            except ValueError as error:
                rospy.logerr_throttle(1.0, f"camera: {error}")
        for _ in waiting:
            self._traffic.handled(SCENE)

    def _due(self, scene: SimScene) -> bool:
        tick = round(scene.header.stamp.to_sec() * TICK_RATE)
        return tick % self._parameters.every == 0

    def _draw(self, scene: SimScene) -> None:
        stamp = scene.header.stamp
        frame = self._renderer.render(messages.scene_of_message(scene))
        for name, picture in zip(PICTURES, frame, strict=True):
            self._publish(name, stamp, self._lenses[name], picture)

    def _publish(self, name: str, stamp: Any, lens: Lens, picture: Any) -> None:
        """The calibration first: who has the picture has it too."""
        self._infos[name].publish(messages.camera_info(stamp, lens))
        self._pictures[name].publish(messages.image(stamp, lens, picture))


def main() -> int:
    """Run until Ctrl-C (0) or refuse a parameter or file (2)."""
    rospy.init_node("camera")
    try:
        p = CameraNodeParameters.load(rospy.get_param("~", {}), rospy.get_name())
        parameters = CameraParameters.load(p.camera_file, p.poses_file, p.helmet_file)
        files = (p.cell_file, p.limits_file)
        renderer = CellRenderer.of_files(*files, parameters, p.seed, p.shadows)
    except ValueError as error:
        rospy.logfatal("%s", error)
        return 2
    CameraNode(renderer, parameters).run()
    renderer.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
