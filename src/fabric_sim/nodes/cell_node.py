#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The pretend cell as a node: devices' topics, the arm's action, the simulated clock."""

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import actionlib
import rosgraph
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from fabric_msgs.arm_action import MoveArmServer
from fabric_msgs.msg import (
    Heartbeat,
    MoveArmActionGoal,
    MoveArmFeedback,
    RobotActionState,
    TaskState,
)
from fabric_msgs.srv import (
    Command,
    CommandResponse,
    HumanCommand,
    HumanCommandResponse,
    SetConveyor,
    SetConveyorResponse,
    SetSuction,
    SetSuctionResponse,
)
from fabric_msgs.traffic import Traffic, introduce
from fabric_sim import frames, reports
from fabric_sim.arm import JOINT_NAMES, ArmResult
from fabric_sim.arm_goals import taken
from fabric_sim.camera.filmed import TOPICS, FilmedCell, SensorParameters
from fabric_sim.cell import Cell, CellConfig, Stimulus
from fabric_sim.cell_parameters import CAMERA, MANUAL, CellParameters
from fabric_sim.emulated import EmulatedCell, EmulatorEyes, without_devices
from fabric_sim.geometry import Point
from fabric_sim.lockstep import Lockstep, Pace, Stalled
from fabric_sim.manual_commands import NAMES
from fabric_sim.manual_worker import ManualStaff
from fabric_sim.quiescence import CAMERA_EDGES, CELL, EDGES, Counts, Quiescence
from fabric_sim.staff import Staff
from fabric_sim.topics import CANCEL, COUNTED, DEVICES, GOAL, LATCHED, RESULT

PATIENCE = 3.0  # s, wall time that a connection may take before its subscribers are told again


class ArmServer(MoveArmServer):
    """Serves `arm/move` and counts goals, cancellations and results."""

    def __init__(
        self, traffic: Traffic, cell: Cell, config: CellConfig, handled: Callable[[str], None]
    ) -> None:
        self._traffic = traffic
        self._cell, self._limits = cell, config.limits
        self._handles: dict[int, actionlib.ServerGoalHandle] = {}
        super().__init__()
        self.lock = traffic.lock  # one lock: callbacks and the main loop take both in any order
        # rospy calls the subscribers of a topic in their order: the server, then the count. The
        # first ones only ask for a connection without delay.
        rospy.Subscriber(GOAL, MoveArmActionGoal, tcp_nodelay=True)
        rospy.Subscriber(CANCEL, GoalID, tcp_nodelay=True)
        for topic in (GOAL, CANCEL):
            traffic.declare_handled(topic)
        traffic.declare_sent(RESULT, lambda: self.result_pub.get_num_connections())
        self.start()
        rospy.Subscriber(GOAL, MoveArmActionGoal, lambda _: handled(GOAL))
        rospy.Subscriber(CANCEL, GoalID, lambda _: handled(CANCEL))

    def publish_result(self, status, result) -> None:
        """Count every result, also those that the action library sends by itself."""
        self._traffic.sent(RESULT)
        super().publish_result(status, result)

    def finish(self, result: ArmResult) -> None:
        """Tell the client how its goal ended."""
        handle = self._handles.pop(result.number, None)
        if handle is not None:
            self.end(handle, result.outcome, result.reason)

    def report(self) -> None:
        """Accept what began to move, and publish how far it is."""
        handle = self._handles.get(self._cell.arm.number)
        if handle is None:
            return
        self.accept(handle)
        arm = self._cell.arm
        pose = reports.pose(Point(*arm.pose[:3]), arm.pose.yaw)
        handle.publish_feedback(MoveArmFeedback(pose, arm.remaining))

    def on_goal(self, handle: actionlib.ServerGoalHandle) -> bool:
        """As MoveArmServer.on_goal."""
        message = handle.get_goal()
        goal = taken(message, self._limits, self._handles)
        if isinstance(goal, ArmResult):
            self.end(handle, goal.outcome, goal.reason)
            return False
        self._handles[message.number] = handle
        self._cell.move(message.number, goal)
        return True

    def on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        """As MoveArmServer.on_cancel."""
        self._cell.cancel(handle.get_goal().number)


class CellNode:
    """The graph as the lockstep sees it: publishes, listens, counts."""

    def __init__(
        self, config: CellConfig, staff: Staff | ManualStaff, parameters: CellParameters
    ) -> None:
        cell = self._cell = Cell(config, staff.worker(1), parameters.seed)
        self._config = config
        self._staff = staff
        self._parameters = parameters
        self._filmed = parameters.sensing == CAMERA
        edges = CAMERA_EDGES if self._filmed else EDGES
        self._runs, self._topics = _filmed(cell, parameters) if self._filmed else (cell, COUNTED)
        self._emulated: EmulatedCell | None = None
        if parameters.emulator:  # arm and belt are the driver's
            eyes = EmulatorEyes(Path(parameters.emulator))
            self._runs = self._emulated = EmulatedCell(self._runs, cell, config, eyes)
            edges = without_devices(edges)
            self._topics = {k: v for k, v in self._topics.items() if k not in DEVICES}
        self._quiescence = Quiescence(parameters.expected, edges)
        self._traffic = Traffic(CELL)
        self._heard = threading.Condition(self._traffic.lock)
        self._master = rosgraph.Master(rospy.get_name())
        self._remind_at = time.monotonic() + PATIENCE
        rospy.on_shutdown(self._wake)
        with self._traffic.lock:
            self._advertise()
            self._listen()
        self._serve()

    @property
    def closed(self) -> bool:
        """True after Ctrl-C."""
        return rospy.is_shutdown()

    @property
    def ready(self) -> bool:
        """False while somebody at the keys has yet to begin the task."""
        return getattr(self._cell.worker, "ready", True)

    def run(self) -> None:
        """Keep cell and graph in step until shutdown. Raises Stalled."""
        p = self._parameters
        pace = Pace(p.speed, p.guard, p.startup_guard)
        with self._traffic.lock:  # released whenever the lockstep waits
            Lockstep(self._runs, self, pace).run()

    def wait(self, seconds: float) -> None:
        """Let callbacks run until anything is heard."""
        self._heard.wait(seconds)

    def missing(self) -> list[str]:
        """Nodes and connections that are not there yet."""
        self._look_at_myself()
        self._remind()
        missing = self._quiescence.missing() or self._quiescence.missing(self._subscribers())
        return missing or (self._emulated.missing() if self._emulated else [])

    def forgive_losses(self) -> None:
        """Start to count from here."""
        self._quiescence.forgive_losses()
        rospy.loginfo("the cell is ready: %s", ", ".join(sorted(self._parameters.expected)))

    def outstanding(self) -> list[str]:
        """Nodes that have work left."""
        self._look_at_myself()
        return self._quiescence.outstanding()

    def send(self, stimulus: Stimulus) -> None:
        """Publish counted messages."""
        for topic, message in stimulus.messages:
            if topic == RESULT:
                self._arm.finish(message)
            else:
                self._counted[topic].publish(message)

    def show(self, output: Any) -> None:
        """Publish the clock, the arm and the frames; while time stands, the clock only."""
        self._clock.publish(Clock(reports.header(self._cell.now).stamp))
        if output is None:
            return
        t = output.t
        if not self._emulated:
            self._show_arm(t)
        tool_frame = frames.of_tool(self._cell, t) if self._parameters.arm_frames else []
        if self._filmed:
            person = frames.of_pose(output.pose, self._cell.geometry.person.yaw, t)
        else:
            person = frames.of_person(self._cell, t)
        self._moving_frames.sendTransform(person + tool_frame)

    def _show_arm(self, t: float) -> None:
        self._arm.report()
        arm = self._cell.arm
        joints = JointState(header=reports.header(t, ""), name=list(JOINT_NAMES))
        joints.position = list(arm.joints)
        self._joint_states.publish(joints)
        tool = reports.pose(Point(*arm.pose[:3]), arm.pose.yaw)
        self._tcp.publish(PoseStamped(reports.header(t, "arm_base_link"), tool))

    # -- wiring ---------------------------------------------------------------------------------

    def _advertise(self) -> None:
        publisher = self._traffic.publisher
        self._counted = {
            name: publisher(name, kind, name in LATCHED) for name, kind in self._topics.items()
        }
        if not self._emulated:
            self._arm = ArmServer(self._traffic, self._cell, self._config, self._handled)
            self._joint_states = rospy.Publisher("arm/joint_states", JointState, queue_size=10)
            self._tcp = publisher("arm/tcp", PoseStamped)
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10)
        self._moving_frames = tf2_ros.TransformBroadcaster()
        self._fixed_frames = tf2_ros.StaticTransformBroadcaster()
        if self._parameters.arm_frames:
            self._fixed_frames.sendTransform(frames.of_cell(self._cell))

    def _listen(self) -> None:
        self._traffic.subscribe("task/state", TaskState, self._on_task)
        self._traffic.declare_handled("robot/state")
        self._robot_sequence = 0
        locked = self._traffic.serialised
        rospy.Subscriber(
            "robot/state", RobotActionState, locked(self._on_robot_state), tcp_nodelay=True
        )
        rospy.Subscriber("heartbeat", Heartbeat, locked(self._on_heartbeat), tcp_nodelay=True)

    def _serve(self) -> None:
        locked = self._traffic.serialised
        if not self._emulated:
            rospy.Service("arm/home", Command, locked(self._home))
            rospy.Service("arm/clear_alarms", Command, locked(self._clear_alarms))
            rospy.Service("arm/set_suction", SetSuction, locked(self._set_suction))
            rospy.Service("conveyor/set_speed", SetConveyor, locked(self._set_conveyor))
        if self._parameters.human == MANUAL:
            rospy.Service("human/command", HumanCommand, locked(self._command_person))

    def _wake(self) -> None:
        with self._heard:
            self._heard.notify_all()

    def _handled(self, topic: str) -> None:
        with self._heard:
            self._traffic.handled(topic)
            self._heard.notify_all()

    def _look_at_myself(self) -> None:
        self._quiescence.heard(CELL, _counts(*self._traffic.entries()))

    def _remind(self) -> None:
        """Have connections made again that did not come about for a while."""
        now = time.monotonic()
        if now >= self._remind_at:
            self._remind_at = now + PATIENCE
            introduce(["heartbeat", *self._quiescence.unconnected(self._subscribers())])

    def _subscribers(self) -> dict[str, int]:
        """How many nodes the master knows to listen to each counted topic."""
        listeners = dict(self._master.getSystemState()[1])
        topics = {topic: rospy.resolve_name(topic) for topic in self._quiescence.topics}
        return {topic: len(listeners.get(name, [])) for topic, name in topics.items()}

    # -- callbacks, all behind the lock ---------------------------------------------------------

    def _on_heartbeat(self, message: Heartbeat) -> None:
        if message.node != CELL:
            self._quiescence.heard(message.node, _counts(message.handled, message.sent))
            self._heard.notify_all()

    def _on_task(self, state: TaskState) -> None:
        if state.task_id != self._cell.task.task_id and state.task_id != 0:
            self._cell.worker = self._staff.worker(state.task_id)
        self._cell.on_task(state)
        self._heard.notify_all()

    def _on_robot_state(self, state: RobotActionState) -> None:
        if state.sequence != self._robot_sequence:
            self._robot_sequence = state.sequence
            self._cell.on_robot_state(state)
            self._traffic.handled("robot/state", state.sequence)
            self._heard.notify_all()

    def _home(self, _: object) -> CommandResponse:
        self._cell.home()
        return CommandResponse(True, "")

    def _clear_alarms(self, _: object) -> CommandResponse:
        return CommandResponse(True, "the simulated arm raises no alarms")

    def _set_suction(self, request: object) -> SetSuctionResponse:
        self._cell.set_suction(request.on)
        return SetSuctionResponse(True, "")

    def _set_conveyor(self, request: object) -> SetConveyorResponse:
        try:
            self._cell.set_conveyor(round(request.speed, 6), request.ignore_sensor)
        except ValueError as error:
            return SetConveyorResponse(False, str(error))
        return SetConveyorResponse(True, "")

    def _command_person(self, request: object) -> HumanCommandResponse:
        name = NAMES[request.action] if request.action < len(NAMES) else str(request.action)
        accepted, reason = self._cell.worker.command(name, request.container)
        self._heard.notify_all()
        return HumanCommandResponse(accepted, reason)


def _filmed(cell: Cell, parameters: CellParameters) -> tuple[Any, dict[str, Any]]:
    """The cell as cameras see it, and what it sends. Raises ValueError for a bad file."""
    sensors = SensorParameters.load(parameters.sensors_file)
    return FilmedCell(cell, parameters.seed, sensors), TOPICS


def _counts(handled: list, sent: list) -> Counts:
    return Counts(
        {entry.topic: entry.count for entry in handled},
        {entry.topic: entry.count for entry in sent},
        {entry.topic: entry.connections for entry in sent},
    )


def staff_of(parameters: CellParameters) -> Staff | ManualStaff:
    """Who works in the cell. Raises ValueError for a type or file that cannot be simulated."""
    if parameters.human == MANUAL:
        return ManualStaff(parameters.seed)
    return Staff(parameters.human, parameters.seed)


def main() -> int:
    """Run until Ctrl-C (0), a bad parameter (2) or a node that does not answer (1)."""
    rospy.init_node("cell")
    try:
        parameters = CellParameters.load(rospy.get_param("~", {}), rospy.get_name())
        config = CellConfig.load(
            parameters.cell_file,
            parameters.limits_file,
            parameters.arm_file,
            parameters.sensing_file,
        )
        staff = staff_of(parameters)
        node = CellNode(config, staff, parameters)
    except ValueError as error:
        rospy.logfatal("%s", error)
        return 2
    try:
        node.run()
    except Stalled as error:
        rospy.logfatal("%s", error)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
