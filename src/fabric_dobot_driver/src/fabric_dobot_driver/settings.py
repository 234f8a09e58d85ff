# SPDX-License-Identifier: BSD-3-Clause
"""Settings of the driver: one place for default, unit, range and meaning of each."""

from dataclasses import dataclass

from fabric_dobot_driver.kinematics import ToolPose
from fabric_msgs.settings import check_settings, setting


@dataclass(frozen=True)
class DriverSettings:
    """How the driver talks to the arm and the belt. Raises ValueError naming a bad value."""

    reply_timeout: float = setting(0.1, "s", 0.02, 1.0, "an answer that takes longer is lost")
    tries: int = setting(3, "", 1, 10, "answers lost in a row after which the arm counts as gone")
    reconnect: float = setting(1.0, "s", 0.1, 60.0, "between attempts to find the port again")
    pose_rate: float = setting(30.0, "Hz", 1.0, 100.0, "of looks at the pose")
    index_rate: float = setting(30.0, "Hz", 1.0, 100.0, "of looks at the queue while moving")
    alarm_rate: float = setting(10.0, "Hz", 1.0, 50.0, "of looks at the alarms")
    lease: float = setting(0.3, "s", 0.1, 5.0, "the arm holds when motion is silent for longer")
    acceleration: float = setting(0.8, "m/s^2", 0.01, 5.0, "of the tool")
    yaw_speed: float = setting(3.0, "rad/s", 0.01, 6.0, "of the tool servo")
    yaw_acceleration: float = setting(10.0, "rad/s^2", 0.01, 50.0, "of the tool servo")
    arrival: float = setting(0.003, "m", 1e-4, 0.05, "a goal farther away is not reached")
    overtime: float = setting(5.0, "s", 0.5, 60.0, "a move may take longer than it should")
    homing_time: float = setting(90.0, "s", 5.0, 600.0, "that homing may take")
    home_x: float = setting(0.197, "m", 0.1, 0.35, "where homing ends, in arm_base_link")
    home_y: float = setting(-0.001, "m", -0.35, 0.35, "where homing ends")
    home_z: float = setting(0.035, "m", -0.1, 0.25, "where homing ends")
    stepper: int = setting(0, "", 0, 1, "connector of the belt's motor: 0 is Stepper1")
    pulses_per_mm: float = setting(282.9, "1/mm", 1.0, 2000.0, "of belt travel; calibrate it")
    belt_speed: float = setting(0.12, "m/s", 0.001, 0.5, "the belt's fastest")
    infrared_port: int = setting(2, "", 0, 3, "of the sensor: GP1, GP2, GP4, GP5 are 0 to 3")
    infrared_version: int = setting(1, "", 0, 1, "of the sensor")
    infrared_rate: float = setting(25.0, "Hz", 1.0, 100.0, "of looks at the sensor")
    infrared_clear: float = setting(0.1, "s", 0.0, 2.0, "of a free beam before the belt goes on")

    def __post_init__(self) -> None:
        check_settings(self)

    @property
    def home(self) -> ToolPose:
        """Where homing ends."""
        return ToolPose(self.home_x, self.home_y, self.home_z, 0.0)
