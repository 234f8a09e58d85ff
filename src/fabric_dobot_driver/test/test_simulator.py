# SPDX-License-Identifier: BSD-3-Clause
"""The driver against pydobotlab's own simulator: another's idea of the same arm."""

import math
import threading
import time

import pytest
from fake_magician import LIMITS
from pydobotlab import simulator

from fabric_dobot_driver import ToolPose
from fabric_dobot_driver.arm_device import ArmDevice
from fabric_dobot_driver.controller import Controller
from fabric_dobot_driver.conveyor_device import ConveyorDevice
from fabric_dobot_driver.events import ArmResult
from fabric_dobot_driver.limits import Goal
from fabric_dobot_driver.link import SerialLink
from fabric_dobot_driver.settings import DriverSettings
from fabric_msgs.msg import MoveArmResult

LIMIT = 20.0  # s
OUT_OF_WORKSPACE = simulator.ALARM_OUT_OF_WORKSPACE_CODE


class Rig:
    """The driver in its thread, as behind the node."""

    def __init__(self, port):
        self.changed = threading.Condition()
        self.results = {}
        settings = DriverSettings()
        self.arm = ArmDevice(LIMITS, settings, time.monotonic, self.tell)
        self.belt = ConveyorDevice(settings, time.monotonic, self.tell)
        link = SerialLink(port, settings.reply_timeout)
        self.controller = Controller(link, self.arm, self.belt, settings, self.tell)
        self.thread = threading.Thread(target=self.controller.run, daemon=True)
        self.thread.start()

    def tell(self, event):
        with self.changed:
            self.arm.beat()  # the motion node is well
            if isinstance(event, ArmResult):
                self.results[event.number] = event
            self.changed.notify_all()

    def until(self, condition):
        with self.changed:
            assert self.changed.wait_for(condition, LIMIT)

    def go(self, number, *place):
        self.arm.move(number, Goal(ToolPose(*place, 0.0), 0.2))
        self.controller.wake()

    def end(self, number):
        self.until(lambda: number in self.results)
        return self.results[number]


@pytest.fixture
def rig(monkeypatch):
    monkeypatch.setattr("serial.Serial", simulator.FakeDobotSerial)
    rig = Rig("/dev/sim-of-the-driver")
    rig.until(lambda: rig.arm.connected)
    rig.arm.home()
    rig.controller.wake()
    rig.until(lambda: rig.arm.homed)
    yield rig
    rig.controller.close()
    rig.thread.join(LIMIT)
    simulator.stop_all()


def test_it_goes_where_it_is_sent(rig):
    rig.go(1, 0.23, -0.05, 0.06)
    assert rig.end(1) == (1, MoveArmResult.REACHED, "")
    assert math.dist(rig.arm.pose[:3], (0.23, -0.05, 0.06)) < 1e-5


def test_it_stops_in_mid_motion_and_goes_on_with_a_new_goal(rig):
    rig.go(1, 0.20, -0.20, 0.06)
    rig.until(lambda: rig.arm.moving == 1 and rig.arm.pose.y < -0.02)
    rig.arm.cancel(1)
    rig.controller.wake()
    assert rig.end(1).outcome == MoveArmResult.PRE_EMPTED
    assert rig.arm.pose.y > -0.19
    rig.go(2, 0.23, 0.05, 0.06)
    assert rig.end(2).outcome == MoveArmResult.REACHED


def test_an_alarm_is_told_cleared_and_left_behind(rig):
    fake = simulator.get_or_create_fake("/dev/sim-of-the-driver")
    rig.go(1, 0.20, -0.20, 0.06)
    rig.until(lambda: rig.arm.moving == 1 and rig.arm.pose.y < -0.02)
    fake._alarms[OUT_OF_WORKSPACE // 8] |= 1 << OUT_OF_WORKSPACE % 8
    assert rig.end(1).reason == "alarm PLAN_INVERSE_CALCULATION"
    assert rig.controller.ask(rig.arm.clear_alarms).result(LIMIT) == ""
    rig.go(2, 0.23, 0.05, 0.06)
    assert rig.end(2).outcome == MoveArmResult.REACHED
