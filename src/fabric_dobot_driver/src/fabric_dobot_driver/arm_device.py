# SPDX-License-Identifier: BSD-3-Clause
"""The arm as a state machine: goals in, results out, one exchange on the wire at a time.

    device.move(1, goal)                    # from any thread; returns at once
    while (act := device.urgent() or device.command() or ...):
        act(wire)                           # the controller's thread, see controller.py

What is told (`tell`): ArmState after every look at the pose, ArmResult once for each goal, Notice.
Nothing moves before homing, without the lease, or while an alarm is set.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from fabric_dobot_driver import alarms
from fabric_dobot_driver.alarms import AlarmSet
from fabric_dobot_driver.events import Act, ArmResult, ArmState, Notice
from fabric_dobot_driver.kinematics import ToolPose
from fabric_dobot_driver.lease import Lease
from fabric_dobot_driver.limits import Fault, Goal, Limits, check_goal, check_path
from fabric_dobot_driver.settings import DriverSettings
from fabric_dobot_driver.wire import Wire
from fabric_msgs.msg import MoveArmResult

OUTCOMES = {
    Fault.INVALID: MoveArmResult.INVALID,
    Fault.UNREACHABLE: MoveArmResult.UNREACHABLE,
}
HOMING = 0  # in the place of a goal's number
STILL = 2e-4  # m that a standing tool seems to move
CALM = 0.3  # s after which a tool that has not moved stands


@dataclass
class _Motion:
    """A goal on its way; None for homing. deadline, reached: monotonic s.

    stood: since when (s) and where the tool stands elsewhere although the queue is through.
    """

    number: int
    goal: Goal | None
    deadline: float
    index: int | None = None
    reached: float | None = None
    stood: tuple[float, ToolPose] | None = None


class ArmDevice:
    """See the module. Only move, cancel, halt, home, clear_alarms and beat come from other threads.

    clock: monotonic, s.
    """

    def __init__(
        self,
        limits: Limits,
        settings: DriverSettings,
        clock: Callable[[], float],
        tell: Callable[[object], None],
    ) -> None:
        self._limits, self._settings = limits, settings
        self._clock, self._tell = clock, tell
        self.lease = Lease(settings.lease)
        self.connected = self.homed = False
        self.alarms: AlarmSet = alarms.NONE
        self.pose: ToolPose | None = None
        self._inbox: deque[Callable[[], None]] = deque()  # appended to by other threads
        self._stopping: deque[Act] = deque()  # acts of a stop under way
        self._issuing: deque[Act] = deque()  # acts that put a motion on the wire, or conclude it
        self._ended: list[ArmResult] = []  # told when the stop is through
        self._motion: _Motion | None = None
        self._next: tuple[int, Goal] | None = None
        self._profile = 0.0  # m/s that the arm was told

    # -- from any thread ------------------------------------------------------------------------

    def move(self, number: int, goal: Goal) -> None:
        """Go there; a goal under way is displaced. One ArmResult follows, also for a refusal."""
        self._inbox.append(lambda: self._on_move(number, goal))

    def cancel(self, number: int) -> None:
        """Stop the goal of that number; nothing happens when it is over."""
        self._inbox.append(lambda: self._on_cancel(number))

    def halt(self, reason: str) -> None:
        """Stop whatever moves, homing too."""
        self._inbox.append(lambda: self._on_halt(reason))

    def home(self) -> str:
        """Find the references and go home; return why not, or nothing."""
        if not self.connected:
            return "the arm is not connected"
        self._inbox.append(self._on_home)
        return ""

    def beat(self) -> None:
        """The holder of the lease is alive."""
        self.lease.renew(self._clock())

    @property
    def moving(self) -> int | None:
        """Number of the goal under way, 0 while homing, None when nothing moves."""
        motion = self._motion
        return motion.number if motion else None

    # -- the controller's thread ----------------------------------------------------------------

    def setup(self) -> list[Act]:
        """What a freshly opened port is told: first to hold, and nothing that moves."""
        s, links = self._settings, self._limits.links
        return [
            lambda wire: wire.force_stop(),
            lambda wire: wire.clear_queue(),
            lambda wire: wire.tool(links.tool_x, links.tool_y, links.tool_z),
            lambda wire: self._discard(wire.home_pose(s.home)),
            lambda wire: self._discard(wire.full_ratio()),
            self.look_at_alarms,
            self.look_at_pose,
            lambda wire: wire.start_queue(),
        ]

    def on_open(self) -> None:
        """The port is open and was told everything."""
        self.connected = True

    def on_lost(self, reason: str) -> None:
        """The arm is gone; what it does is not known, so it has to be homed when it is back."""
        self.connected = self.homed = False
        self._profile = 0.0
        self.pose = None
        self._stopping.clear()
        self._end(MoveArmResult.ARM_FAULT, reason)
        self._report_ends()

    def urgent(self) -> Act | None:
        """The next exchange of a stop, or None."""
        self._read()
        return self._script(self._stopping) if self._stopping else None

    def command(self) -> Act | None:
        """The next exchange of a motion, or None."""
        if not self._issuing and self._next is not None:
            self._begin(*self._next)
        return self._script(self._issuing) if self._issuing else None

    @property
    def due(self) -> float:
        """When something has to be decided even if nothing comes over the wire, s."""
        motion = self._motion
        if motion is None:
            return math.inf
        times = [motion.deadline]
        if motion.number != HOMING:
            times.append(self.lease.ends)
            if motion.reached is not None and motion.goal is not None:
                times.append(motion.reached + motion.goal.settle)
        return min(times)

    def look_at_pose(self, wire: Wire) -> None:
        """Read the pose and tell it."""
        pose, joints = wire.pose()
        self.pose = pose
        motion = self._motion
        goal = motion.goal if motion else None
        remaining = math.dist(pose[:3], goal.pose[:3]) if goal else 0.0
        number = motion.number if motion and motion.goal else None
        self._tell(ArmState(pose, joints, number, remaining))

    def look_at_alarms(self, wire: Wire) -> None:
        """Read the alarms; a new one ends the motion, and may cost the reference."""
        before, self.alarms = self.alarms, wire.alarms()
        fresh = [code for code in self.alarms if code not in before]
        if fresh:
            self._tell(Notice(f"alarm: {', '.join(alarms.names(fresh))}", True))
        if self.homed and alarms.unhomes(self.alarms):
            self.homed = False
            self._tell(Notice("the arm lost its reference: home it", True))
        if fresh and self._motion and self._motion.number != HOMING:
            self._fail_by_alarm()

    def look_at_queue(self, wire: Wire) -> None:
        """See whether the motion is done."""
        motion = self._motion
        if motion is None or motion.index is None or motion.reached is not None:
            return
        if wire.finished(motion.index):
            alarmed = self.clear_alarms if motion.goal is None else self.look_at_alarms
            self._issuing = deque([alarmed, self.look_at_pose, self._conclude])

    def clear_alarms(self, wire: Wire) -> None:
        """Clear the alarms and look what is left."""
        wire.clear_alarms()
        self.alarms = wire.alarms()

    @property
    def watching(self) -> bool:
        """Whether the queue is worth a look."""
        motion = self._motion
        return motion is not None and motion.index is not None and not self._issuing

    # -- inputs, in the controller's thread -----------------------------------------------------

    def _read(self) -> None:
        while self._inbox:
            self._inbox.popleft()()
        now, motion = self._clock(), self._motion
        if motion is None:
            return
        if motion.number != HOMING and not self.lease.holds(now):
            words = f"no heartbeat of the motion node for more than {self.lease.term:g} s"
            self._stop(MoveArmResult.ARM_FAULT, words)
        elif now >= motion.deadline:
            self._stop(MoveArmResult.ARM_FAULT, "the goal was not reached in time")
        elif motion.reached is not None and motion.goal is not None:
            if now >= motion.reached + motion.goal.settle:
                self._end(MoveArmResult.REACHED, "")
                self._report_ends()

    def _on_move(self, number: int, goal: Goal) -> None:
        if self._next is not None:
            displaced = ArmResult(self._next[0], MoveArmResult.PRE_EMPTED, f"goal {number} came")
            self._tell(displaced)
        self._next = (number, goal)
        if self._motion is not None and self._motion.number != HOMING:
            self._stop(MoveArmResult.PRE_EMPTED, f"goal {number} came")

    def _on_cancel(self, number: int) -> None:
        if self._next is not None and self._next[0] == number:
            self._next = None
            self._tell(ArmResult(number, MoveArmResult.PRE_EMPTED, "cancelled"))
        if self._motion is not None and self._motion.number == number != HOMING:
            self._stop(MoveArmResult.PRE_EMPTED, "cancelled")

    def _on_halt(self, reason: str) -> None:
        if self._next is not None:
            waiting, self._next = self._next, None
            self._tell(ArmResult(waiting[0], MoveArmResult.PRE_EMPTED, reason))
        self._stop(MoveArmResult.PRE_EMPTED, reason)

    def _on_home(self) -> None:
        if not self.connected:
            return
        self._stop(MoveArmResult.PRE_EMPTED, "the arm is sent home")
        self.homed = False
        self._motion = _Motion(HOMING, None, self._clock() + self._settings.homing_time)
        self._issuing = deque([self.clear_alarms, self._issue(lambda wire: wire.home())])
        self._tell(Notice("homing"))

    # -- motions --------------------------------------------------------------------------------

    def _begin(self, number: int, goal: Goal) -> None:
        self._next = None
        refusal = self._refusal(goal)
        if refusal is not None:
            self._tell(ArmResult(number, *refusal))
            return
        assert self.pose is not None
        s = self._settings
        planned = math.dist(self.pose[:3], goal.pose[:3]) / goal.speed + goal.settle
        planned += abs(goal.pose.yaw - self.pose.yaw) / s.yaw_speed
        self._motion = _Motion(number, goal, self._clock() + planned + s.overtime)
        if goal.speed != self._profile:
            self._issuing.append(lambda wire: self._set_profile(wire, goal.speed))
        self._issuing.append(self._issue(lambda wire: wire.move(goal.pose)))

    def _refusal(self, goal: Goal) -> tuple[int, str] | None:
        fault = MoveArmResult.ARM_FAULT
        if not self.connected or self.pose is None:
            return fault, "the arm is not connected"
        if self._motion is not None:
            return fault, "the arm is homing"
        if not self.homed:
            return fault, "the arm has not been homed since it was connected: call arm/home"
        if self.alarms:
            words = ", ".join(alarms.names(self.alarms))
            return fault, f"alarm {words}: call arm/clear_alarms"
        if not self.lease.holds(self._clock()):
            return fault, "no heartbeat of the motion node"
        refusal = check_goal(goal, self._limits) or check_path(self.pose, goal.pose, self._limits)
        return (OUTCOMES[refusal.fault], refusal.reason) if refusal else None

    def _issue(self, request: Callable[[Wire], int]) -> Act:
        """The act that queues the motion under way and keeps its index."""

        def act(wire: Wire) -> None:
            index = request(wire)
            if self._motion is not None:
                self._motion.index = index

        return act

    def _set_profile(self, wire: Wire, speed: float) -> None:
        s = self._settings
        wire.profile(speed, s.acceleration, s.yaw_speed, s.yaw_acceleration)
        self._profile = speed

    def _conclude(self, _: Wire) -> None:
        """The queue is through: is the tool where it was sent?"""
        motion = self._motion
        if motion is None or self.pose is None:
            return
        if motion.goal is None:
            return self._conclude_homing()
        now = self._clock()
        distance = math.dist(self.pose[:3], motion.goal.pose[:3])
        if distance <= self._settings.arrival:
            motion.reached = now
        elif motion.stood is None or math.dist(motion.stood[1][:3], self.pose[:3]) > STILL:
            motion.stood = now, self.pose
        elif now >= motion.stood[0] + CALM:
            words = f"the arm stands {1e3 * distance:.1f} mm before the goal"
            self._stop(MoveArmResult.ARM_FAULT, words)

    def _conclude_homing(self) -> None:
        self._motion = None
        self.homed = not self.alarms
        if self.homed:
            self._tell(Notice("the arm is homed"))
        else:
            left = ", ".join(alarms.names(self.alarms))
            self._tell(Notice(f"homing ended with alarm {left}", True))

    def _fail_by_alarm(self) -> None:
        words = ", ".join(alarms.names(self.alarms))
        goal_at_fault = alarms.unreachable(self.alarms)
        outcome = MoveArmResult.UNREACHABLE if goal_at_fault else MoveArmResult.ARM_FAULT
        self._stop(outcome, f"alarm {words}")

    # -- stops ----------------------------------------------------------------------------------

    def _stop(self, outcome: int, reason: str) -> None:
        """Hold now; the motion's result is told when the arm has answered where it stands."""
        self._end(outcome, reason)
        if self.connected:
            self._stopping = deque(
                [
                    lambda wire: wire.force_stop(),
                    lambda wire: wire.clear_queue(),
                    self.look_at_pose,
                    lambda wire: wire.start_queue(),
                    lambda _: self._report_ends(),
                ]
            )
        else:
            self._report_ends()

    def _end(self, outcome: int, reason: str) -> None:
        motion, self._motion = self._motion, None
        self._issuing.clear()
        if motion is None:
            return
        if motion.number == HOMING:
            self.homed = False
            self._tell(Notice(f"homing was stopped: {reason}", True))
        else:
            self._ended.append(ArmResult(motion.number, outcome, reason))

    def _report_ends(self) -> None:
        ended, self._ended = self._ended, []
        for result in ended:
            self._tell(result)

    @staticmethod
    def _script(acts: deque[Act]) -> Act:
        """The first act; it leaves the script when it is done."""

        def act(wire: Wire) -> None:
            first = acts[0]
            first(wire)
            if acts and acts[0] is first:
                acts.popleft()

        return act

    @staticmethod
    def _discard(_: int) -> None:
        """For acts that return an index nobody waits for."""
