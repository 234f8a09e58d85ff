#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Dobot Magician as a node: arm and belt hang on one controller, so one node owns its port."""

import math
import queue
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import TimeoutError as NotInTime

import actionlib
import rospy
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from fabric_dobot_driver import Joints, Limits, Refusal, ToolPose, load_limits
from fabric_dobot_driver import alarms as alarm_words
from fabric_dobot_driver.arm_device import HOMING, OUTCOMES, ArmDevice
from fabric_dobot_driver.controller import Controller
from fabric_dobot_driver.conveyor_device import ConveyorDevice
from fabric_dobot_driver.events import ArmResult, ArmState, Notice
from fabric_dobot_driver.goals import asked
from fabric_dobot_driver.guard import Guard
from fabric_dobot_driver.limits import Fault
from fabric_dobot_driver.link import SerialLink
from fabric_dobot_driver.settings import DriverSettings
from fabric_dobot_driver.wire import Wire, hold_frames
from fabric_msgs.arm_action import MoveArmServer
from fabric_msgs.msg import (
    ConveyorState,
    Heartbeat,
    MoveArmFeedback,
    SafetyState,
)
from fabric_msgs.settings import settings_from
from fabric_msgs.srv import (
    Command,
    CommandResponse,
    SetConveyor,
    SetConveyorResponse,
    SetSuction,
    SetSuctionResponse,
)
from fabric_msgs.traffic import Traffic

BASE = "arm_base_link"
BELT_PERIOD = 0.1  # s between conveyor/state
HEALTH_PERIOD = 1.0  # s between diagnostics
HOLDING = 2.0  # s that the last two frames may take
PATIENCE = 1.0  # s that a service waits for the arm to answer


class ArmServer(MoveArmServer):
    """Serves `arm/move`. A cancellation reaches the arm before the action library sees it."""

    def __init__(self, arm: ArmDevice, limits: Limits, wake: Callable[[], None]) -> None:
        self._arm, self._limits, self._wake = arm, limits, wake
        self._handles: dict[int, actionlib.ServerGoalHandle] = {}
        self._numbers: dict[str, int] = {}  # the arm's number of a goal's id
        self._last = 0
        # rospy calls the subscribers of a topic in their order, each topic in its own thread
        rospy.Subscriber("arm/move/cancel", GoalID, self._on_cancel_message, tcp_nodelay=True)
        super().__init__()
        self.start()

    def _on_cancel_message(self, goal_id: GoalID) -> None:
        number = self._numbers.get(goal_id.id)
        if not goal_id.id and goal_id.stamp == rospy.Time():
            self._arm.halt("everything was cancelled")
        elif number is not None:
            self._arm.cancel(number)
        self._wake()

    def finish(self, result: ArmResult) -> None:
        """Tell the client how its goal ended."""
        with self.lock:
            handle = self._handles.pop(result.number)
            del self._numbers[handle.get_goal_id().id]
            self.end(handle, result.outcome, result.reason)

    def report(self, state: ArmState) -> None:
        """Say how far the goal is."""
        with self.lock:
            handle = self._handles.get(state.number)
            if handle is not None:
                self.accept(handle)
                handle.publish_feedback(MoveArmFeedback(pose_of(state.pose), state.remaining))

    def on_goal(self, handle: actionlib.ServerGoalHandle) -> bool:
        """As MoveArmServer.on_goal."""
        message = handle.get_goal()
        wanted = asked(message, self._limits)
        if message.number == 0:
            wanted = Refusal(Fault.INVALID, "goal number 0 is not allowed")
        if isinstance(wanted, Refusal):
            self.end(handle, OUTCOMES[wanted.fault], wanted.reason)
            return False
        self._last += 1
        self._handles[self._last] = handle
        self._numbers[handle.get_goal_id().id] = self._last
        self._arm.move(self._last, wanted)
        self._wake()
        return True

    def on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        """As MoveArmServer.on_cancel."""
        number = self._numbers.get(handle.get_goal_id().id)
        if number is not None:
            self._arm.cancel(number)
            self._wake()


class ArmNode:
    """Topics, services and diagnostics around the controller's thread."""

    def __init__(self, port: str, settings: DriverSettings, limits_file: str) -> None:
        self._events: queue.Queue[tuple[rospy.Time, object]] = queue.Queue()
        tell, clock = self._tell, time.monotonic
        limits = load_limits(limits_file)
        self._arm = ArmDevice(limits, settings, clock, tell)
        self._belt = ConveyorDevice(settings, clock, tell)
        frames = hold_frames(settings.stepper)
        link = SerialLink(
            port, settings.reply_timeout, post=lambda port: Guard(port, settings.lease, frames)
        )
        self._controller = Controller(link, self._arm, self._belt, settings, tell)
        self._holder = rospy.get_param("~lease_holder", "motion")
        self._home_at_start = rospy.get_param("~home_at_start", False)
        self._stamps: dict[str, rospy.Time] = {}
        self._stopped = False
        self._joint_states = rospy.Publisher("arm/joint_states", JointState, queue_size=10)
        self._tcp = rospy.Publisher("arm/tcp", PoseStamped, queue_size=10)
        self._conveyor = rospy.Publisher("conveyor/state", ConveyorState, queue_size=10)
        self._health = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._server = ArmServer(self._arm, limits, self._controller.wake)
        rospy.Subscriber("heartbeat", Heartbeat, self._on_heartbeat, tcp_nodelay=True)
        rospy.Subscriber("safety/state", SafetyState, self._on_safety, tcp_nodelay=True)
        rospy.Service("arm/home", Command, self._home)
        rospy.Service("arm/clear_alarms", Command, self._clear_alarms)
        rospy.Service("arm/set_suction", SetSuction, self._set_suction)
        rospy.Service("conveyor/set_speed", SetConveyor, self._set_conveyor)
        self._traffic: Traffic | None = None  # beats from the first homing on

    def run(self) -> None:
        """Until shutdown. Then the arm holds and the belt stands.

        This thread only waits: a signal's handler runs in it, and closes what others publish on.
        """
        rospy.on_shutdown(self._controller.close)
        wire = threading.Thread(target=self._controller.run, name="wire", daemon=True)
        wire.start()
        threading.Thread(target=self._tell_on, name="tell", daemon=True).start()
        rospy.spin()
        wire.join(HOLDING)

    def _tell_on(self) -> None:
        """Hand on what the devices tell, and what is due by the clock."""
        self._belt_at = self._health_at = time.monotonic()
        while not rospy.is_shutdown():
            try:
                self._hand_on(min(self._belt_at, self._health_at))
                self._tell_regularly(time.monotonic())
            except Exception as error:  # this thread is the node's voice: it goes on
                if not rospy.is_shutdown():  # a topic that was closed meanwhile is no error
                    rospy.logerr_throttle(1.0, f"arm: {error!r}")

    def _tell_regularly(self, now: float) -> None:
        if now >= self._belt_at:
            self._belt_at = max(self._belt_at + BELT_PERIOD, now)
            self._publish_belt(rospy.Time.now())
        if now >= self._health_at:
            self._health_at = max(self._health_at + HEALTH_PERIOD, now)
            self._publish_health()

    def _hand_on(self, until: float) -> None:
        try:
            stamp, event = self._events.get(timeout=max(0.0, until - time.monotonic()))
        except queue.Empty:
            return
        if isinstance(event, ArmState):
            self._publish_pose(stamp, event)
        elif isinstance(event, ArmResult):
            self._server.finish(event)
        elif isinstance(event, Notice):
            self._note(event)

    def _tell(self, event: object) -> None:
        self._events.put((rospy.Time.now(), event))

    # -- what is published ----------------------------------------------------------------------

    def _fresh(self, topic: str, stamp: rospy.Time) -> bool:
        """False while a simulated clock stands: nobody needs the same moment twice."""
        if self._stamps.get(topic) == stamp:
            return False
        self._stamps[topic] = stamp
        return True

    def _publish_pose(self, stamp: rospy.Time, state: ArmState) -> None:
        if self._fresh("arm", stamp):
            joints = JointState(header=Header(stamp=stamp), name=list(Joints._fields))
            joints.position = list(state.joints)
            self._joint_states.publish(joints)
            self._tcp.publish(PoseStamped(Header(0, stamp, BASE), pose_of(state.pose)))
        self._server.report(state)

    def _publish_belt(self, stamp: rospy.Time) -> None:
        if self._belt.connected and self._fresh("belt", stamp):
            speed, cube = self._belt.state
            self._conveyor.publish(ConveyorState(Header(stamp=stamp), speed, cube))

    def _note(self, notice: Notice) -> None:
        (rospy.logerr if notice.serious else rospy.loginfo)("arm: %s", notice.text)
        self._publish_health()
        if self._arm.homed and self._traffic is None:
            self._traffic = Traffic("arm")
        if self._home_at_start and self._arm.connected and not self._arm.homed:
            self._home_at_start = False
            rospy.logwarn("arm: homing, as ~home_at_start asks for")
            self._home(None)

    def _publish_health(self) -> None:
        arm, controller = self._arm, self._controller
        status = DiagnosticStatus(name="arm", hardware_id=controller.port)
        names = alarm_words.names(arm.alarms)
        if not arm.connected:
            status.level, status.message = DiagnosticStatus.ERROR, controller.trouble
        elif names:
            status.level, status.message = DiagnosticStatus.ERROR, f"alarm {', '.join(names)}"
        elif not arm.homed:
            status.level, status.message = DiagnosticStatus.WARN, "not homed: call arm/home"
        else:
            status.level, status.message = DiagnosticStatus.OK, "ready"
        pairs = zip(names, alarm_words.cures(arm.alarms), strict=True)
        status.values = [KeyValue(name, cure) for name, cure in pairs]
        held = arm.lease.holds(time.monotonic())
        status.values.append(KeyValue("lease", "held" if held else "lapsed"))
        status.values.append(KeyValue("answers lost", str(controller.answers_lost)))
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._health.publish(message)

    # -- what is listened to and served ---------------------------------------------------------

    def _on_heartbeat(self, message: Heartbeat) -> None:
        if message.node == self._holder:
            self._arm.beat()

    def _on_safety(self, message: SafetyState) -> None:
        """Goals are the motion node's to stop. Homing is nobody's, so a stop ends it here."""
        self._stopped = message.state == SafetyState.STOP
        if self._stopped and self._arm.moving == HOMING:
            self._arm.halt(f"safety stop: {message.cause}")
            self._controller.wake()

    def _home(self, _: object) -> CommandResponse:
        reason = "safety/state says STOP" if self._stopped else self._arm.home()
        self._controller.wake()
        return CommandResponse(not reason, reason)

    def _clear_alarms(self, _: object) -> CommandResponse:
        reason = self._ask(self._arm.clear_alarms)
        left = alarm_words.names(self._arm.alarms)
        if not reason and left:
            reason = f"still set: {', '.join(left)}"
        return CommandResponse(not reason, reason)

    def _set_suction(self, request: object) -> SetSuctionResponse:
        reason = self._ask(lambda wire: wire.suction(request.on))
        return SetSuctionResponse(not reason, reason)

    def _set_conveyor(self, request: object) -> SetConveyorResponse:
        reason = self._belt.run(request.speed, request.ignore_sensor)
        self._controller.wake()
        return SetConveyorResponse(not reason, reason)

    def _ask(self, act: Callable[[Wire], None]) -> str:
        answer = self._controller.ask(act)
        try:
            return answer.result(PATIENCE)
        except NotInTime:
            answer.cancel()
            return "the arm does not answer"


def pose_of(pose: ToolPose) -> Pose:
    """The message of a pose."""
    half = 0.5 * pose.yaw
    turn = Quaternion(0.0, 0.0, math.sin(half), math.cos(half))
    return Pose(Point(pose.x, pose.y, pose.z), turn)


def main() -> int:
    """Run until Ctrl-C (0) or a bad parameter (2)."""
    rospy.init_node("arm")
    try:
        settings = settings_from(DriverSettings, rospy.get_param("~driver", {}))
        node = ArmNode(rospy.get_param("~port"), settings, rospy.get_param("~limits_file"))
    except KeyError as error:
        rospy.logfatal("parameter %s is missing", rospy.resolve_name(error.args[0]))
        return 2
    except (TypeError, ValueError, OSError) as error:
        rospy.logfatal("%s: %s", rospy.get_name(), error)
        return 2
    node.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
