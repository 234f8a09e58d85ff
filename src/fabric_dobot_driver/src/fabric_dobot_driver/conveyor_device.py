# SPDX-License-Identifier: BSD-3-Clause
"""The belt on the arm's extension stepper, and the infrared sensor that stops it.

The belt stands as long as something is in the beam, unless it was told to ignore the sensor; then
it runs on at the speed that was asked for. The beam has to be free for a moment before it does:
edges chatter.
"""

import math
from collections.abc import Callable

from fabric_dobot_driver import units
from fabric_dobot_driver.events import Act, BeltState
from fabric_dobot_driver.settings import DriverSettings
from fabric_dobot_driver.wire import Wire


class ConveyorDevice:
    """See the module. `run` comes from any thread, the rest from the controller's.

    clock: monotonic, s.
    """

    def __init__(
        self,
        settings: DriverSettings,
        clock: Callable[[], float],
        tell: Callable[[object], None],
    ) -> None:
        self._settings, self._clock, self._tell = settings, clock, tell
        self._wanted = (0.0, False)  # speed in m/s, ignore the sensor
        self._told: int | None = None  # pulses a second; None when that is not known
        self.cube = False
        self._free_since = -math.inf
        self.connected = False

    def run(self, speed: float, ignore_sensor: bool) -> str:
        """Run at `speed` m/s, forwards, 0 stops; return why not, or nothing."""
        if not math.isfinite(speed) or not 0.0 <= speed <= self._settings.belt_speed:
            top = self._settings.belt_speed
            return f"belt speed is {speed}, want a finite number of m/s, 0 to {top:g}"
        if not self.connected:
            return "the arm, which drives the belt, is not connected"
        self._wanted = (speed, ignore_sensor)
        return ""

    @property
    def state(self) -> BeltState:
        """What the belt does."""
        return BeltState(
            units.belt_from_wire(self._told or 0, self._settings.pulses_per_mm), self.cube
        )

    def setup(self) -> list[Act]:
        """What a freshly opened port is told: the belt stands."""
        s = self._settings
        return [
            lambda wire: wire.belt(s.stepper, 0),
            lambda wire: wire.enable_infrared(s.infrared_port, s.infrared_version),
        ]

    def on_open(self) -> None:
        """The port is open and was told everything."""
        self._wanted = (0.0, False)
        self._told = 0
        self.connected = True

    def on_lost(self) -> None:
        """The controller is gone; the belt does not start by itself when it is back."""
        self.connected = False
        self._wanted = (0.0, False)
        self._told = None

    def command(self) -> Act | None:
        """The exchange that gives the motor another speed, or None."""
        return self._run if self._told != self._pulses() else None

    @property
    def due(self) -> float:
        """When the belt may have to start again, s."""
        waiting = not self.cube and self._told == 0 and self._wanted[0] > 0.0
        return self._free_since + self._settings.infrared_clear if waiting else math.inf

    def look_at_sensor(self, wire: Wire) -> None:
        """Read the sensor."""
        self.see(wire.infrared(self._settings.infrared_port))

    def see(self, cube: bool) -> None:
        """The sensor said that something is in the beam, or nothing."""
        if self.cube and not cube:
            self._free_since = self._clock()
        self.cube = cube

    def _pulses(self) -> int:
        speed, ignore_sensor = self._wanted
        free = not self.cube and self._clock() >= self._free_since + self._settings.infrared_clear
        if not free and not ignore_sensor:
            return 0
        return units.belt_to_wire(speed, self._settings.pulses_per_mm)

    def _run(self, wire: Wire) -> None:
        pulses = self._pulses()
        wire.belt(self._settings.stepper, pulses)
        self._told = pulses
        self._tell(self.state)
