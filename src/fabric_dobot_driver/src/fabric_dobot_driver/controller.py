# SPDX-License-Identifier: BSD-3-Clause
"""Who may speak on the one serial line: a stop first, then commands, then looks.

The arm's controller drives the belt too, so one thread owns the port and asks both devices what is
next. One exchange is under way at a time; a stop waits for that one at most.
"""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from fabric_dobot_driver.arm_device import ArmDevice
from fabric_dobot_driver.conveyor_device import ConveyorDevice
from fabric_dobot_driver.events import Act, Notice
from fabric_dobot_driver.link import Link, LinkLost, NoAnswer
from fabric_dobot_driver.settings import DriverSettings
from fabric_dobot_driver.wire import Wire


@dataclass
class _Look:
    """Something that is read again and again. wanted: whether it is worth it now."""

    period: float
    act: Act
    wanted: Callable[[], bool] = lambda: True
    due: float = 0.0


class Controller:
    """Runs an arm and its belt over a link; `run` is the thread, `step` one exchange of it."""

    def __init__(
        self,
        link: Link,
        arm: ArmDevice,
        belt: ConveyorDevice,
        settings: DriverSettings,
        tell: Callable[[object], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._link, self._wire = link, Wire(link)
        self._arm, self._belt = arm, belt
        self._settings, self._tell, self._clock = settings, tell, clock
        self._setup: deque[Act] = deque()
        self._jobs: deque[tuple[Act, Future[str]]] = deque()
        self._open = False
        self._lost = 0  # answers in a row
        self._retry_at = -math.inf
        self._closed = False
        self._woken = threading.Condition()
        self._news = False
        self.trouble = "not connected yet"  # empty when all is well
        self.port = ""
        self.answers_lost = 0
        s = settings
        self._looks = [
            _Look(1.0 / s.pose_rate, arm.look_at_pose),
            _Look(1.0 / s.index_rate, arm.look_at_queue, lambda: arm.watching),
            _Look(1.0 / s.alarm_rate, arm.look_at_alarms),
            _Look(1.0 / s.infrared_rate, belt.look_at_sensor),
        ]

    # -- from any thread ------------------------------------------------------------------------

    def wake(self) -> None:
        """A device was told something: look at it now."""
        with self._woken:
            self._news = True
            self._woken.notify_all()

    def ask(self, act: Act) -> "Future[str]":
        """Have an exchange carried out; the future holds why not, or an empty word.

        Cancel the future when nobody waits any more: what comes too late is not to happen.
        """
        future: Future[str] = Future()
        if not self._arm.connected:
            future.set_result("the arm is not connected")
            return future
        self._jobs.append((act, future))
        self.wake()
        return future

    def close(self) -> None:
        """End `run`, with the arm holding and the belt standing."""
        self._closed = True
        self.wake()

    # -- the thread -----------------------------------------------------------------------------

    def run(self) -> None:
        """Exchange until closed."""
        while not self._closed:
            delay = self.step()
            with self._woken:
                if not self._news and delay > 0.0 and not self._closed:
                    self._woken.wait(delay)
                self._news = False
        self._hold()

    def step(self) -> float:
        """Do what is next; return the seconds until something is due, 0 when at once."""
        if not self._open:
            return self._connect()
        act = self._next()
        if act is None:
            return max(0.0, self._due() - self._clock())
        try:
            act(self._wire)
        except NoAnswer as error:
            self._lost += 1
            self.answers_lost += 1
            if self._lost >= self._settings.tries:
                self._drop(f"the arm does not answer: {error}")
        except LinkLost as error:
            self._drop(str(error))
        else:
            self._lost = 0
        return 0.0

    def _next(self) -> Act | None:
        """The most urgent exchange."""
        urgent = self._arm.urgent()
        if self._setup:
            return self._set_up
        return urgent or self._belt.command() or self._job() or self._arm.command() or self._look()

    def _connect(self) -> float:
        self._arm.urgent()  # goals that come meanwhile are refused
        self._arm.command()
        wait = self._retry_at - self._clock()
        if wait > 0.0:
            return wait
        self._retry_at = self._clock() + self._settings.reconnect
        try:
            self.port = self._link.open()
        except LinkLost as error:
            self._trouble(str(error))
            return self._settings.reconnect
        self._open, self._lost = True, 0
        self._wire = Wire(self._link)
        arm = self._arm.setup()
        self._setup = deque([*arm[:2], *self._belt.setup(), *arm[2:]])  # hold, then the belt
        return 0.0

    def _set_up(self, wire: Wire) -> None:
        self._setup[0](wire)
        self._setup.popleft()
        if not self._setup:
            self._arm.on_open()
            self._belt.on_open()
            self.trouble = ""
            self._tell(Notice(f"connected to the arm on {self.port}; it has to be homed"))

    def _drop(self, reason: str) -> None:
        self._open = False
        self._retry_at = self._clock() + self._settings.reconnect
        self._setup.clear()
        self._link.close()
        self._arm.on_lost(reason)
        self._belt.on_lost()
        while self._jobs:
            self._answer(self._jobs.popleft()[1], reason)
        self._trouble(reason)

    def _trouble(self, reason: str) -> None:
        if reason != self.trouble:
            self._tell(Notice(reason, True))
        self.trouble = reason

    def _job(self) -> Act | None:
        while self._jobs and self._jobs[0][1].cancelled():
            self._jobs.popleft()
        if not self._jobs:
            return None
        act, future = self._jobs[0]

        def job(wire: Wire) -> None:
            act(wire)
            self._jobs.popleft()
            self._answer(future, "")

        return job

    @staticmethod
    def _answer(future: "Future[str]", reason: str) -> None:
        if future.set_running_or_notify_cancel():
            future.set_result(reason)

    def _look(self) -> Act | None:
        """The look that is overdue most."""
        now = self._clock()
        due = [look for look in self._looks if look.due <= now and look.wanted()]
        if not due:
            return None
        look = min(due, key=lambda one: one.due)
        look.due = max(look.due + look.period, now)
        return look.act

    def _due(self) -> float:
        looks = (look.due for look in self._looks if look.wanted())
        return min(self._arm.due, self._belt.due, *looks)

    def _hold(self) -> None:
        """Leave the arm and the belt standing."""
        if self._open:
            try:
                self._wire.force_stop()
                self._wire.belt(self._settings.stepper, 0)
            except (NoAnswer, LinkLost) as error:
                self._tell(Notice(f"the arm was not told to hold: {error}", True))
        self._link.close()
