# SPDX-License-Identifier: BSD-3-Clause
"""The arm on a pseudo-terminal: one loop around the firmware, the line and who commands it."""

import json
import math
import selectors
import socket
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TextIO

from fabric_dobot_driver.emulator import commands
from fabric_dobot_driver.emulator.controller import Controller
from fabric_dobot_driver.emulator.faults import Faults
from fabric_dobot_driver.emulator.frames import Frame, Parser, encode
from fabric_dobot_driver.emulator.link import Terminal
from fabric_dobot_driver.emulator.settings import Settings
from fabric_dobot_driver.emulator.words import Planned, parse

BYTES_PER_SECOND = 11520.0  # 115200 baud, ten bits a byte
TICK = 0.01  # s between looks at what moves
SILENCE = 0.05  # s without a byte after which a frame that has begun is given up
LISTENING = 5


class Emulator:
    """Runs until told to stop; `stop` may come from another thread or a signal handler."""

    def __init__(
        self,
        link: Path | None = None,
        settings: Settings | None = None,
        *,
        seed: int = 0,
        speed: float = 1.0,
        script: Sequence[Planned] = (),
        log: TextIO | None = None,
        announce: Callable[[str], None] | None = None,
    ) -> None:
        """speed: seconds of the arm in one real second; announce: told the path of the port.

        Raises FileExistsError when the link's name is taken, by a file or another emulator.
        """
        self._start = time.monotonic()
        self._speed = speed
        self._log_file = log
        self._announce = announce or (lambda path: None)
        self.faults = Faults(seed)
        self.controller = Controller(settings, self._log_event)
        self.terminal = Terminal(link)
        self._parser = Parser()
        self._heard = 0.0
        self._outbox: deque[tuple[float, bytes, Frame | None]] = deque()
        self._line_free = 0.0
        self._script = deque(script)
        self._replug = math.inf
        self._powered = True
        self._selector = selectors.DefaultSelector()
        self._wake, self._woken = socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ, self._stop_now)
        self._running = True
        self._control = control_of(link) if link is not None else None
        self._listener = self._listen() if self._control is not None else None
        self._plug()

    # --- from outside ---

    def stop(self) -> None:
        """Ends `run`."""
        self._wake.send(b"x")

    def run(self) -> None:
        """Answers until stopped, then removes the link."""
        try:
            while self._running:
                # First what has come in: the rest of a frame must not be late because we are.
                for key, _ in self._selector.select(self._patience()):
                    key.data()
                self._pass()
        finally:
            self._close()

    def silence(self, seconds: float) -> None:
        """Neither hears nor answers for so long."""
        self.faults.silent_until = self._now() + seconds

    def send_garbage(self, count: int) -> None:
        """Noise towards the client."""
        if self.terminal.plugged:
            self.terminal.write(self.faults.garbage(count))

    def unplug(self, seconds: float) -> None:
        """Pulls the USB plug for so long; the arm goes on with its queue."""
        if self.terminal.plugged:
            self._selector.unregister(self.terminal)
            self.terminal.unplug()
        self._outbox.clear()
        self._parser = Parser()
        self._replug = self._now() + seconds
        self._log("unplugged")

    def power_off(self, seconds: float) -> None:
        """Takes the power away for so long; the arm forgets everything."""
        self.unplug(seconds)
        self._powered = False

    def state(self) -> dict:
        """Where everything is, for people and tests."""
        arm, queue, outside = self.controller, self.controller.queue, self.controller.extension
        per_mm = arm.settings.pulses_per_mm
        return {
            "time": round(arm.time, 6),
            "pose": [round(value, 4) for value in arm.pose],
            "joints": [round(value, 4) for value in arm.joints],
            "moving": arm.arm.moving,
            "homed": arm.homed,
            "alarms": sorted(int(code) for code in arm.alarms),
            "queue": {
                "running": queue.running,
                "issued": queue.issued,
                "finished": queue.finished,
                "space": queue.space,
            },
            "suction": arm.register(commands.SUCTION) == (1, 1),
            "gripper": arm.register(commands.GRIPPER) == (1, 1),
            "belt": [round(s.pulses / per_mm, 4) for s in outside.steppers],
            "belt_speed": [round(s.speed / per_mm, 4) for s in outside.steppers],
            "infrared": outside.seen(),
            "cubes": [[round(c.place - outside.belt, 4), c.colour] for c in outside.cubes],
        }

    # --- the loop ---

    def _now(self) -> float:
        """Real seconds since the start."""
        return time.monotonic() - self._start

    def _patience(self) -> float | None:
        waits = [self._replug]
        if self._outbox:
            waits.append(self._outbox[0][0])
        if self._script:
            waits.append(self._script[0].at)
        if self._parser.waiting:
            waits.append(self._heard + SILENCE)
        if self.controller.busy:
            waits.append(self._now() + TICK)
        soonest = min(waits)
        return None if math.isinf(soonest) else max(0.0, soonest - self._now())

    def _pass(self) -> None:
        now = self._now()
        if now >= self._replug:
            self._plug()
        if self._powered:
            self.controller.advance(now * self._speed)
        while self._script and self._script[0].at <= now:
            self._say(self._script.popleft().line)
        if self._parser.waiting and now >= self._heard + SILENCE:
            self._answer(self._parser.give_up())
        self._send_due(now)

    def _plug(self) -> None:
        self._replug = math.inf
        self.terminal.plug()
        self._selector.register(self.terminal, selectors.EVENT_READ, self._hear)
        if not self._powered:
            self._powered = True
            self.controller.time = self._now() * self._speed
            self.controller.power_up()
        self._log("plugged", path=self.terminal.path)
        self._announce(self.terminal.path)

    def _hear(self) -> None:
        if not self.terminal.plugged:
            return
        data = self.terminal.read()
        self._heard = self._now()
        if self._heard >= self.faults.silent_until:
            self._answer(self._parser.feed(data))

    def _answer(self, frames: Sequence[Frame]) -> None:
        for frame in frames:
            self._log_frame("in", frame)
            answer = self.controller.handle(frame, self._now() * self._speed)
            if answer is not None:
                self._post(answer)
        self._send_due(self._now())

    def _post(self, answer: Frame) -> None:
        """Puts the answer into the outbox, at the time when its last byte is through."""
        data = encode(answer)
        passed = self.faults.answer(data)
        if passed:
            through = max(self._now(), self._line_free) + len(data) / BYTES_PER_SECOND
            self._line_free = through
            self._outbox.append((through + self.faults.delay, passed, answer))

    def _send_due(self, now: float) -> None:
        while self._outbox and self._outbox[0][0] <= now:
            _, data, answer = self._outbox.popleft()
            if now >= self.faults.silent_until:
                self.terminal.write(data)
                self._log_frame("out", answer)

    # --- words ---

    def _listen(self) -> socket.socket:
        if _alive(self._control):
            raise FileExistsError(f"another emulator listens at {self._control}")
        self._control.unlink(missing_ok=True)
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(str(self._control))
        listener.listen(LISTENING)
        self._selector.register(listener, selectors.EVENT_READ, self._accept)
        return listener

    def _accept(self) -> None:
        connection, _ = self._listener.accept()
        connection.setblocking(False)
        begun = bytearray()
        self._selector.register(
            connection, selectors.EVENT_READ, lambda: self._listen_to(connection, begun)
        )

    def _listen_to(self, connection: socket.socket, begun: bytearray) -> None:
        try:
            data = connection.recv(4096)
            begun += data
            while b"\n" in begun:
                line, _, rest = bytes(begun).partition(b"\n")
                begun[:] = rest
                connection.sendall(self._say(line.decode(errors="replace")).encode() + b"\n")
        except OSError:
            data = b""
        if not data:
            self._selector.unregister(connection)
            connection.close()

    def _say(self, line: str) -> str:
        """Carries out one line; the answer."""
        try:
            answer = parse(line)(self)
        except ValueError as error:
            answer = f"error: {error}"
        self._log("word", line=line.strip(), carried_out=not answer.startswith("error"))
        if self._powered:
            self.controller.advance(self.controller.time)
        return answer

    # --- the end ---

    def _stop_now(self) -> None:
        self._running = False

    def _close(self) -> None:
        self.terminal.unplug()
        if self._listener is not None:
            self._control.unlink(missing_ok=True)
        for key in list(self._selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
        self._wake.close()
        self._selector.close()

    # --- log ---

    def _log_frame(self, direction: str, frame: Frame) -> None:
        if self._log_file is not None:
            self._log(
                direction,
                id=frame.id,
                name=commands.name_of(frame.id),
                control=frame.control,
                params=frame.params.hex(),
            )

    def _log_event(self, event: str, **details: object) -> None:
        self._log(event, arm_time=round(self.controller.time, 6), **details)

    def _log(self, event: str, **details: object) -> None:
        if self._log_file is not None:
            self._log_file.write(
                json.dumps({"t": time.monotonic(), "event": event} | details) + "\n"
            )


def control_of(link: Path) -> Path:
    """Socket at which the emulator behind this link listens."""
    return link.with_name(link.name + ".control")


def tell(link: Path, line: str) -> str:
    """Says a line of words to the emulator behind this link; its answer.

    Raises OSError when there is none.
    """
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(str(control_of(link)))
        connection.sendall(line.strip().encode() + b"\n")
        with connection.makefile() as answers:
            return answers.readline().strip()


def _alive(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as connection:
        try:
            connection.connect(str(path))
        except OSError:
            return False
    return True
