#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ROS node of the tracker: pictures of the cell camera in; cubes, containers and the hand out."""

import cv2
import diagnostic_updater
import message_filters
import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    CubeArray,
    HandState,
    LoadCellReadings,
    TaskState,
)
from fabric_msgs.settings import settings_from
from fabric_msgs.traffic import PICTURES, Traffic
from fabric_perception.camera_listener import CameraListener
from fabric_perception.camera_poses import PARENT
from fabric_perception.images import colour_of, depth_of, fill
from fabric_perception.picture_input import PictureTimes
from fabric_perception.tracking.colours import Palette
from fabric_perception.tracking.health import Health
from fabric_perception.tracking.overlay import draw_overlay
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.session import TrackingSession
from fabric_perception.tracking.weighing import Scales, scale_parameters
from fabric_perception.tracking.workspace import Workspace

COLOUR, DEPTH = "cell/camera/rgb/image_raw", "cell/camera/depth/image"
INFO, OVERLAY = "cell/camera/rgb/camera_info", "cell/camera/overlay"
APART = 0.02  # s, between a colour and a depth picture that belong together
QUEUE = 10  # pictures that wait for their partner


class TrackingNode:
    """Answers every pair of pictures with cubes and hand of its stamp."""

    def __init__(
        self,
        workspace: Workspace,
        palette: Palette,
        parameters: TrackingParameters,
        scales: Scales | None,
    ) -> None:
        self._session = TrackingSession(workspace, palette, parameters, scales)
        self._weighs = scales is not None
        self._times = PictureTimes(parameters.stale_after)
        self._health = Health()
        self._traffic = Traffic("tracking")
        self._advertise()
        self._listen()

    def _advertise(self) -> None:
        self._cubes = self._traffic.publisher("cell/cubes", CubeArray)
        self._containers = self._traffic.publisher("cell/containers", ContainerArray, latch=True)
        self._hands = self._traffic.publisher("human/hand", HandState)
        self._overlay = rospy.Publisher(OVERLAY, Image, queue_size=1)
        self._diagnostics = diagnostic_updater.Updater()
        self._diagnostics.setHardwareID("cell camera")
        self._diagnostics.add("tracking", self._diagnose)
        rospy.Timer(rospy.Duration(1.0), lambda _: self._diagnostics.update())

    def _listen(self) -> None:
        self._source = CameraListener(self._traffic, INFO, self._session.forget_camera)
        self._traffic.subscribe("arm/tcp", PoseStamped, self._on_cup)
        self._traffic.subscribe("conveyor/state", ConveyorState, self._on_conveyor)
        self._traffic.subscribe("task/state", TaskState, self._on_task)
        if self._weighs:
            self._traffic.subscribe("sensors/load_cells", LoadCellReadings, self._on_load_cells)
        colours, depths = message_filters.SimpleFilter(), message_filters.SimpleFilter()
        self._pairs = message_filters.ApproximateTimeSynchronizer([colours, depths], QUEUE, APART)
        self._pairs.registerCallback(self._on_pictures)
        # counted subscriptions feed the filters: a picture is handled when its pair is, or waits
        self._traffic.subscribe(COLOUR, Image, colours.signalMessage, **PICTURES)
        self._traffic.subscribe(DEPTH, Image, depths.signalMessage, **PICTURES)

    # -- what it is told ------------------------------------------------------------------------

    def _on_cup(self, pose: PoseStamped) -> None:
        at = pose.pose.position
        self._session.on_cup(pose.header.stamp.to_sec(), (at.x, at.y, at.z))

    def _on_conveyor(self, state: ConveyorState) -> None:
        self._session.on_conveyor(state)

    def _on_task(self, task: TaskState) -> None:
        """Raises ValueError for a scenario without containers, which the traffic logs."""
        self._publish_containers(self._session.on_task(task))

    def _on_load_cells(self, readings: LoadCellReadings) -> None:
        """Raises ValueError for readings that make no sense, which the traffic logs."""
        self._publish_containers(self._session.on_load_cells(readings))

    def _on_pictures(self, colour: Image, depth: Image) -> None:
        try:
            self._track(colour, depth)
        except ValueError as error:
            self._health.refuse(rospy.get_time(), str(error))
            rospy.logwarn_throttle(5.0, f"tracking: a picture is left out: {error}")

    # -- what it does ---------------------------------------------------------------------------

    def _track(self, colour: Image, depth: Image) -> None:
        """Raises ValueError when camera or pictures are of no use."""
        stamp = colour.header.stamp
        anew = self._times.accept(rospy.get_time(), stamp.to_sec())
        frame = colour.header.frame_id
        tracking = self._session.tracking or self._session.use_camera(self._source.camera(frame))
        if anew:
            rospy.logwarn(f"tracking: time begins anew at {stamp.to_sec():.2f} s")
            tracking.restart()
        bgr = colour_of(colour)
        header = Header(stamp=stamp, frame_id=PARENT)
        seen, cubes, hand, containers = self._session.on_pictures(header, bgr, depth_of(depth))
        self._cubes.publish(cubes)
        self._hands.publish(hand)
        self._publish_containers(containers)
        self._health.take(rospy.get_time(), stamp.to_sec(), seen.depth_share)
        if self._overlay.get_num_connections():
            drawn = draw_overlay(bgr, tracking.camera, tracking.workspace, seen)
            self._overlay.publish(fill(Image(header=colour.header), drawn))

    def _publish_containers(self, containers: ContainerArray | None) -> None:
        if containers is not None:
            self._containers.publish(containers)

    def _diagnose(
        self, wrapper: diagnostic_updater.DiagnosticStatusWrapper
    ) -> diagnostic_updater.DiagnosticStatusWrapper:
        status = self._health.status(rospy.get_time())
        wrapper.summary(status.level, status.text)
        for name, value in status.values.items():
            wrapper.add(name, value)
        return wrapper


def main() -> None:
    """Run until shutdown; a file or parameter that is wrong ends the node at once, by its name."""
    rospy.init_node("tracking")
    cv2.setNumThreads(1)  # more wait for each other in the kernel, and take the others' cores
    workspace = Workspace.load(rospy.get_param("~cell_file"))
    palette = Palette.load(rospy.get_param("~colours_file"))
    scales = None
    if rospy.has_param("~load_cells"):
        scales = Scales(scale_parameters(rospy.get_param("~load_cells")))
    else:
        rospy.loginfo("tracking: no ~load_cells; cubes in a person's trays count when seen lying")
    TrackingNode(
        workspace, palette, settings_from(TrackingParameters, rospy.get_param("~tracking")), scales
    )
    rospy.spin()


if __name__ == "__main__":
    main()
