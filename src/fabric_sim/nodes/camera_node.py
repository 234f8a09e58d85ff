#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One camera of the pretend cell as a node: scenes in, pictures out.

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
PICTURES = {  # by camera: the name of each stream and its topic
    "cell": {"cell/camera/rgb": "image_raw", "cell/camera/depth": "image"},
    "head": {"head/camera": "image_raw"},
}
PATIENCE = 0.5  # s of wall time between looks at whether to end


class CameraNode:
    """Draws scenes as they come."""

    def __init__(self, camera: str, renderer: CellRenderer, parameters: CameraParameters) -> None:
        self._every = parameters.every
        self._lens: Lens = getattr(parameters, camera)
        self._render = renderer.render_cell if camera == "cell" else renderer.render_head
        self._scenes: deque[SimScene] = deque()
        self._traffic = Traffic(f"{camera}_camera")
        self._arrived = threading.Condition(self._traffic.lock)
        self._pictures = {
            name: self._traffic.publisher(f"{name}/{topic}", Image)
            for name, topic in PICTURES[camera].items()
        }
        self._infos = {
            name: self._traffic.publisher(f"{name}/camera_info", CameraInfo, latch=True)
            for name in PICTURES[camera]
        }
        for info in self._infos.values():
            info.publish(messages.camera_info(rospy.Time(), self._lens))
        self._frames = tf2_ros.StaticTransformBroadcaster()
        self._frames.sendTransform(messages.place_of(self._lens))
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
        return tick % self._every == 0

    def _draw(self, scene: SimScene) -> None:
        stamp = scene.header.stamp
        seen = self._render(messages.scene_of_message(scene))
        for name, picture in zip(self._pictures, seen, strict=True):
            self._publish(name, stamp, picture)

    def _publish(self, name: str, stamp: Any, picture: Any) -> None:
        """The calibration first: who has the picture has it too."""
        self._infos[name].publish(messages.camera_info(stamp, self._lens))
        self._pictures[name].publish(messages.image(stamp, self._lens, picture))


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
    CameraNode(p.camera, renderer, parameters).run()
    renderer.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
