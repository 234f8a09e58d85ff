#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The load cells under the trays as a node: lines of a serial port in, sensors/load_cells out."""

import sys
import time

import rospy
import serial
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from fabric_dobot_driver.load_cells import LineParser, Rows, SimulatedLine
from fabric_msgs.msg import LoadCellReadings

SIMULATED = "simulated"
BATCH = 0.05  # s between messages
RETRY = 1.0  # s between attempts to open the port
SILENCE = 1.0  # s without a reading after which something is wrong


class SerialLine:
    """The controller beside the trays."""

    def __init__(self, port: str, baud: int) -> None:
        self._port = serial.Serial(port, baud, timeout=0.0, exclusive=True)

    def read(self, _: float) -> bytes:
        """What has come since the last call. Raises SerialException when the port is gone."""
        return self._port.read(4096)


class LoadCellNode:
    """Reads, joins, publishes; opens the port again when it is gone."""

    def __init__(self) -> None:
        param = rospy.get_param
        self._name = param("~port")
        self._baud, self._rate = int(param("~baud", 115200)), float(param("~rate"))
        self._seed = int(param("~seed", 1))
        self._channels, containers = list(param("~channels")), list(param("~containers"))
        if len(self._channels) != len(containers) or not self._rate > 0.0:
            raise ValueError(
                f"want a container for each of the channels {self._channels}, rate > 0"
            )
        self._containers = bytes(containers)
        self._rows = Rows(self._channels)
        self._parser = LineParser()
        self._line: SerialLine | SimulatedLine | None = None
        self._begun = self._heard = time.monotonic()
        self._trouble = ""
        self._readings = rospy.Publisher("sensors/load_cells", LoadCellReadings, queue_size=10)
        self._health = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)

    def run(self) -> None:
        """Until shutdown."""
        rate, tick = rospy.Rate(1.0 / BATCH), 0
        while not rospy.is_shutdown():
            rows = self._read()
            if rows:
                self._publish(rows)
            if tick % round(RETRY / BATCH) == 0:
                self._look_after()
            tick += 1
            rate.sleep()

    def _open(self) -> SerialLine | SimulatedLine:
        if self._name == SIMULATED:
            return SimulatedLine(self._channels, self._rate, self._seed)
        return SerialLine(self._name, self._baud)

    def _read(self) -> list[list[int]]:
        if self._line is None:
            return []
        try:
            data = self._line.read(time.monotonic() - self._begun)
        except (serial.SerialException, OSError) as error:
            self._line, self._trouble = None, str(error)
            rospy.logerr("load cells: %s", error)
            return []
        rows = (self._rows.add(*reading) for reading in self._parser.feed(data))
        return [row for row in rows if row is not None]

    def _publish(self, rows: list[list[int]]) -> None:
        self._heard = time.monotonic()
        message = LoadCellReadings(period=1.0 / self._rate, containers=self._containers)
        message.header.stamp = rospy.Time.now()
        message.counts = [count for row in rows for count in row]
        self._readings.publish(message)

    def _look_after(self) -> None:
        if self._line is None:
            try:
                self._line, self._trouble = self._open(), ""
            except (serial.SerialException, OSError) as error:
                self._trouble = str(error)
        elif time.monotonic() - self._heard > SILENCE:
            self._trouble = f"no readings for more than {SILENCE:g} s"
        else:
            self._trouble = ""
        level = DiagnosticStatus.ERROR if self._trouble else DiagnosticStatus.OK
        status = DiagnosticStatus(level, "load cells", self._trouble or "ready", self._name, [])
        status.values.append(KeyValue("damaged lines", str(self._parser.damaged)))
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._health.publish(message)


def main() -> int:
    """Run until Ctrl-C (0) or a bad parameter (2)."""
    rospy.init_node("load_cells")
    try:
        node = LoadCellNode()
    except KeyError as error:
        rospy.logfatal("parameter %s is missing", rospy.resolve_name(error.args[0]))
        return 2
    except (TypeError, ValueError) as error:
        rospy.logfatal("%s: %s", rospy.get_name(), error)
        return 2
    try:
        node.run()
    except rospy.ROSInterruptException:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
