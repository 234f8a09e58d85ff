# SPDX-License-Identifier: BSD-3-Clause
"""The serial line to the arm: one request, one answer.

Frames, checksums and the port itself (control lines low before it opens, a lock against others) are
pydobotlab's. Added here is what it leaves out: an answer has to come in time even in a stream of
garbage, and it has to be the answer to this request.
"""

import termios
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from pydobotlab import discovery, errors
from pydobotlab.config import default_config, set_config
from pydobotlab.protocol import CTRL_QUEUED, CTRL_RW
from pydobotlab.transport import SerialTransport

from fabric_dobot_driver.guard import Guard, GuardGone

AUTO = "auto"
USB_IDS = {(0x10C4, 0xEA60), (0x1A86, 0x7523)}  # the Magician's adapters: CP210x, CH340
# an unplugged port answers in many ways; termios.error is no OSError
PORT_ERRORS = (errors.DobotError, OSError, termios.error)

set_config(default_config())  # neither reads nor writes a file in the user's home
discovery.KNOWN_DOBOT_USB_IDS.update(USB_IDS)


class NoAnswer(Exception):
    """No answer came in time, or a damaged one."""


class LinkLost(Exception):
    """The port is not there, or not any more."""


class Link(Protocol):
    """What carries requests to an arm."""

    def open(self) -> str:
        """Open the port and return its name. Raises LinkLost."""

    def close(self) -> None:
        """Close the port; harmless when it is closed."""

    def exchange(self, command: int, params: bytes, write: bool, queued: bool) -> bytes:
        """Send a request and return the parameters of its answer. Raises NoAnswer, LinkLost."""


class TimedTransport(SerialTransport):
    """pydobotlab's port, with an end to the time that a whole answer may take."""

    def __init__(self, port: str, timeout: float, clock: Callable[[], float]) -> None:
        super().__init__(port, timeout=timeout)
        self._clock = clock
        self._deadline = 0.0

    def begin(self) -> None:
        """The next answer has to come within the time-out from now."""
        self._deadline = self._clock() + self.timeout

    def fileno(self) -> int:
        """Descriptor of the open port."""
        return self._serial.fileno()

    def _read_byte(self) -> bytes:
        if self._clock() > self._deadline:
            raise errors.DobotTimeoutError(f"no answer on {self.port!r} within {self.timeout:g} s")
        return super()._read_byte()


class SerialLink:
    """A Link over a serial port: a device's path, or `auto` for the first arm found on USB."""

    def __init__(
        self,
        port: str,
        timeout: float,
        clock: Callable[[], float] = time.monotonic,
        post: Callable[[int], Guard] | None = None,
    ) -> None:
        """timeout: s for an answer. post: puts a guard at an open port, given its descriptor."""
        self._wanted = port
        self._timeout = timeout
        self._clock = clock
        self._post = post
        self._guard: Guard | None = None
        self._transport: TimedTransport | None = None

    def open(self) -> str:
        """As Link.open. `auto` asks every adapter that an arm may have who is there."""
        self.close()
        port = find_arm(self._timeout) if self._wanted == AUTO else self._wanted
        transport = TimedTransport(port, self._timeout, self._clock)
        try:
            transport.open()
        except PORT_ERRORS as error:
            raise LinkLost(str(error)) from error
        self._transport = transport
        if self._post is not None:
            self._guard = self._post(transport.fileno())
        return port

    def close(self) -> None:
        """As Link.close."""
        guard, self._guard = self._guard, None
        if guard is not None:  # before the port: the guard has it open, too
            guard.close()
        transport, self._transport = self._transport, None
        if transport is not None:
            with suppress(*PORT_ERRORS):
                transport.close()

    def exchange(self, command: int, params: bytes, write: bool, queued: bool) -> bytes:
        """As Link.exchange."""
        if self._transport is None:
            raise LinkLost("the port is closed")
        self._beat()
        control = (CTRL_RW if write else 0) | (CTRL_QUEUED if queued else 0)
        self._transport.begin()
        try:
            answer = self._transport.send_frame(command, control, params)
        except (errors.DobotTimeoutError, errors.DobotProtocolError) as error:
            raise NoAnswer(str(error)) from error
        except PORT_ERRORS as error:
            # a damaged answer is a DobotConnectionError too, with its cause behind it
            if isinstance(error.__cause__, errors.DobotProtocolError):
                raise NoAnswer(str(error)) from error
            raise LinkLost(f"the arm's port is gone: {error}") from error
        if answer.cmd_id != command:
            raise NoAnswer(f"command {command} was answered as {answer.cmd_id}")
        return answer.params

    def _beat(self) -> None:
        if self._guard is None:
            return
        try:
            self._guard.beat()
        except GuardGone as error:
            raise LinkLost(str(error)) from error


def find_arm(timeout: float) -> str:
    """The port of the first Magician on USB; each is asked who it is, none is moved.

    Raises LinkLost telling what was found instead.
    """
    found, failures = discovery.discover_with_diagnostics(only_known_adapters=True, timeout=timeout)
    if found:
        return found[0].port
    told = "; ".join(f"{failure.port}: {failure.detail}" for failure in failures)
    wanted = ", ".join(f"{vendor:04X}:{product:04X}" for vendor, product in sorted(USB_IDS))
    raise LinkLost(f"no arm on USB ({told or f'no adapter {wanted} is plugged in'})")
