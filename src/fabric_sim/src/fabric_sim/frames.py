# SPDX-License-Identifier: BSD-3-Clause
"""The frames of the cell as messages for tf: what stands, the person, the tool."""

from geometry_msgs.msg import TransformStamped

from fabric_sim import reports
from fabric_sim.camera.motion import PersonPose
from fabric_sim.cell import Cell
from fabric_sim.geometry import Frame, Point


def of_cell(cell: Cell) -> list[TransformStamped]:
    """What never moves: the cell in the world, arm and conveyor in the cell."""
    fixed = {"arm_base_link": cell.geometry.arm, "conveyor": cell.geometry.conveyor}
    still = [_transform(0.0, "world", "cell", Frame(0.0, 0.0, 0.0, 0.0))]
    return still + [_transform(0.0, "cell", name, frame) for name, frame in fixed.items()]


def of_person(cell: Cell, t: float) -> list[TransformStamped]:
    """The person, the head and the working hand in the cell at time t (s)."""
    body, yaw = cell.body, cell.geometry.person.yaw
    head = Frame(*body.head, yaw + body.turned)
    return _person(t, Frame(*body.base, yaw), head, Frame(*body.hand, yaw))


def of_pose(pose: PersonPose, yaw: float, t: float) -> list[TransformStamped]:
    """As of_person, of a person in this pose; yaw of the frame person, rad."""
    head = Frame(*pose.head, yaw + pose.yaw)
    return _person(t, Frame(*pose.base, yaw), head, Frame(*pose.hand, yaw))


def of_tool(cell: Cell, t: float) -> list[TransformStamped]:
    """The tool of the arm in its base at time t (s)."""
    return [_transform(t, "arm_base_link", "arm_tcp", Frame(*cell.arm.pose))]


def _person(t: float, base: Frame, head: Frame, hand: Frame) -> list[TransformStamped]:
    places = {"person": base, "person_head": head, "person_hand": hand}
    return [_transform(t, "cell", name, frame) for name, frame in places.items()]


def _transform(t: float, parent: str, child: str, frame: Frame) -> TransformStamped:
    """The frame `child` in its parent."""
    message = TransformStamped(header=reports.header(t, parent), child_frame_id=child)
    pose = reports.pose(Point(*frame[:3]), frame.yaw)
    at = message.transform.translation
    at.x, at.y, at.z = pose.position.x, pose.position.y, pose.position.z
    message.transform.rotation = pose.orientation
    return message
