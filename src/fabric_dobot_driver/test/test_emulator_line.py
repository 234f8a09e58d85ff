# SPDX-License-Identifier: BSD-3-Clause
"""The emulator on a real pseudo-terminal: answers, faults, plug, words, log, the end."""

import json
import os
import select
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from fabric_dobot_driver.emulator import Emulator, Settings, commands, tell
from fabric_dobot_driver.emulator.frames import Frame, Parser, encode
from fabric_dobot_driver.emulator.words import parse_script

LIMIT = 20.0  # s, for what comes at once unless the machine is very busy
SOON = 0.3  # s within which nothing comes
POSE = Frame(commands.POSE, 0)
SUCK = Frame(commands.SUCTION, 1, b"\x01\x01")
FORCE_STOP = Frame(commands.FORCE_STOP, 1)


class Client:
    """The other end of the line."""

    def __init__(self, link: Path) -> None:
        self._port = os.open(link, os.O_RDWR | os.O_NOCTTY)
        self._parser = Parser()

    def close(self) -> None:
        os.close(self._port)

    def send(self, *frames: Frame) -> None:
        self.send_bytes(b"".join(map(encode, frames)))

    def send_bytes(self, data: bytes) -> None:
        os.write(self._port, data)

    def bytes_within(self, seconds: float) -> bytes:
        """What comes next; nothing when nothing comes."""
        ready, _, _ = select.select([self._port], [], [], seconds)
        return os.read(self._port, 4096) if ready else b""

    def answer(self, seconds: float = LIMIT) -> Frame | None:
        """The next whole frame."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            frames = self._parser.feed(self.bytes_within(left))
            if frames:
                assert len(frames) == 1
                return frames[0]
        return None

    def ask(self, frame: Frame) -> Frame | None:
        self.send(frame)
        return self.answer()


class Running:
    """An emulator in a thread."""

    def __init__(self, link: Path, **more) -> None:
        self.link = link
        self.paths: list[str] = []
        self.emulator = Emulator(link, Settings(home_time=1.0), announce=self.paths.append, **more)
        self._thread = threading.Thread(target=self.emulator.run)
        self._thread.start()

    def tell(self, words: str) -> str:
        return tell(self.link, words)

    def state(self) -> dict:
        return json.loads(self.tell("state"))

    def stop(self) -> None:
        self.emulator.stop()
        self._thread.join(LIMIT)
        assert not self._thread.is_alive()


@pytest.fixture
def start(tmp_path):
    """Starts an emulator at a link in a folder of its own; all end with the test."""
    started = []

    def begin(**more) -> Running:
        started.append(Running(tmp_path / "arm", **more))
        return started[-1]

    yield begin
    for running in started:
        if running.link.is_symlink():
            running.stop()


@pytest.fixture
def arm(start) -> Running:
    return start()


@pytest.fixture
def client(arm):
    client = Client(arm.link)
    yield client
    client.close()


def wait_for(condition) -> None:
    """Asks until it is true; an error after the limit."""
    end = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < end
        select.select([], [], [], 0.005)


def test_frames_are_answered_one_by_one_and_in_order(client):
    for _ in range(20):
        assert client.ask(POSE).id == POSE.id
    client.send(POSE, SUCK)
    data = b""
    while len(data) < 38 + 6:
        data += client.bytes_within(LIMIT)
    assert [frame.id for frame in Parser().feed(data)] == [POSE.id, SUCK.id]


def test_the_path_is_told_and_the_link_leads_there_until_the_end(arm):
    assert arm.paths == [os.readlink(arm.link)]
    arm.stop()
    assert not arm.link.is_symlink()
    assert not list(arm.link.parent.iterdir())


def test_a_file_or_another_emulator_is_not_replaced(arm, tmp_path):
    with pytest.raises(FileExistsError, match="another emulator"):
        Emulator(arm.link)
    assert arm.state()["homed"] is False
    file = tmp_path / "precious"
    file.write_text("kept")
    with pytest.raises(FileExistsError, match="precious"):
        Emulator(file)
    assert file.read_text() == "kept"


def test_the_link_of_an_emulator_that_died_is_replaced(tmp_path, start):
    (tmp_path / "arm").symlink_to("/dev/pts/no-such")
    (tmp_path / "arm.control").touch()
    assert start().state()["alarms"] == []


def test_clients_may_come_and_go(arm):
    for _ in range(3):
        client = Client(arm.link)
        assert client.ask(POSE) is not None
        client.close()


def test_motion_takes_its_time_and_is_seen_under_way(arm, client):
    goal = struct.pack("<B4f", 2, 200.0, 60.0, 30.0, 0.0)
    client.ask(Frame(commands.PTP, 3, goal))
    ys = set()
    while arm.state()["moving"]:
        ys.add(struct.unpack_from("<f", client.ask(POSE).params, 4)[0])
    assert len(ys) > 5
    assert arm.state()["pose"][:3] == pytest.approx([200.0, 60.0, 30.0], abs=1e-3)


def test_half_a_frame_and_silence_do_not_cost_the_next_frame(client):
    client.send_bytes(encode(POSE)[:4])
    assert client.bytes_within(SOON) == b""
    assert client.ask(POSE) is not None


def test_silence_hears_and_answers_nothing_and_ends(arm, client):
    assert arm.tell("silence 3600") == "ok"
    client.send(SUCK)
    assert client.bytes_within(SOON) == b""
    assert arm.state()["suction"] is False
    assert arm.tell("calm") == "ok"
    assert client.ask(SUCK) is not None
    assert arm.state()["suction"] is True


def test_delayed_answers_come_late_and_in_order(arm, client):
    arm.tell("delay 0.4")
    start = time.monotonic()
    client.send(POSE)
    assert client.answer() is not None
    assert time.monotonic() - start >= 0.4


def test_a_dropped_answer_does_not_undo_the_command(arm, client):
    arm.tell("drop 1")
    client.send(SUCK)
    assert client.bytes_within(SOON) == b""
    assert arm.state()["suction"] is True


def test_a_damaged_answer_is_no_frame(arm, client):
    arm.tell("corrupt 1")
    client.send(POSE)
    assert client.bytes_within(LIMIT)
    assert client.answer(SOON) is None


def test_garbage_comes_unasked_and_the_line_works_on(arm, client):
    arm.tell("garbage 100")
    data = b""
    while len(data) < 100:
        data += client.bytes_within(LIMIT)
    assert len(data) == 100
    assert client.ask(POSE) is not None


def test_garbage_is_the_same_for_the_same_seed(start):
    heard = []
    for _ in range(2):
        arm = start(seed=105)
        client = Client(arm.link)
        arm.tell("garbage 50")
        heard.append(client.bytes_within(LIMIT))
        client.close()
        arm.stop()
    assert heard[0] == heard[1]


def test_pulling_the_plug_hangs_the_client_up_and_the_arm_goes_on(arm, client):
    client.ask(Frame(commands.PTP, 3, struct.pack("<B4f", 2, 200.0, 60.0, 30.0, 0.0)))
    arm.tell("unplug 0.5")
    assert not arm.link.is_symlink()
    with pytest.raises(OSError):
        while client.bytes_within(LIMIT):
            pass
        raise OSError("hung up")
    wait_for(arm.link.is_symlink)
    assert len(arm.paths) == 2
    wait_for(lambda: not arm.state()["moving"])
    again = Client(arm.link)
    x, y, z = struct.unpack_from("<3f", again.ask(POSE).params)
    again.close()
    assert (x, y, z) == pytest.approx((200.0, 60.0, 30.0), abs=1e-3)


def test_without_power_everything_is_forgotten(arm, client):
    client.ask(SUCK)
    arm.tell("alarm 0x50")
    arm.tell("power 0.1")
    wait_for(arm.link.is_symlink)
    state = arm.state()
    assert (state["suction"], state["alarms"], state["homed"]) == (False, [], False)


def test_words_change_what_the_sensors_see(arm, client):
    client.ask(Frame(commands.INFRARED, 1, b"\x01\x02\x01"))
    look = Frame(commands.INFRARED, 0, b"\x02")
    for words, seen in (
        ("cube", 1),
        ("take", 0),
        ("cube 60 blue", 0),
        ("infrared on", 1),
        ("infrared off", 0),
        ("infrared auto", 0),
    ):
        assert arm.tell(words) == "ok"
        assert client.ask(look).params == bytes((seen,))
    assert arm.state()["cubes"] == [[60.0, "blue"]]
    assert arm.tell("di 3 1") == arm.tell("adc 4 77") == "ok"
    assert client.ask(Frame(commands.DIGITAL_IN, 0, b"\x03")).params == b"\x03\x01"
    assert client.ask(Frame(commands.ANALOG_IN, 0, b"\x04")).params == b"\x04\x4d\x00"


@pytest.mark.parametrize(
    "words", ["dance", "silence x", "drop 2", "di 0 1", "alarm 999", "cube nan", "infrared maybe"]
)
def test_wrong_words_are_answered_with_an_error_and_change_nothing(arm, client, words):
    assert arm.tell(words).startswith("error: ")
    assert client.ask(POSE) is not None


def test_a_script_happens_at_its_times(start):
    arm = start(script=parse_script("0.01: alarm 0x41; cube 0 green", "script"))
    wait_for(lambda: arm.state()["alarms"] == [0x41])
    assert arm.state()["cubes"] == [[0.0, "green"]]


def test_the_log_has_every_frame_and_event_with_times_that_never_turn_back(start, tmp_path):
    with (tmp_path / "log").open("w", buffering=1) as log:
        arm = start(log=log, speed=0.1)  # still under way when it is stopped
        client = Client(arm.link)
        client.ask(Frame(commands.PTP, 3, struct.pack("<B4f", 2, 200.0, 60.0, 30.0, 0.0)))
        client.ask(FORCE_STOP)
        client.close()
        arm.stop()
    entries = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    times = [entry["t"] for entry in entries]
    assert times == sorted(times)
    told = [(entry["event"], entry.get("id")) for entry in entries]
    assert told == [
        ("plugged", None),
        ("in", commands.PTP),
        ("moves", None),
        ("out", commands.PTP),
        ("in", commands.FORCE_STOP),
        ("stands", None),
        ("out", commands.FORCE_STOP),
    ]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_command_prints_its_port_at_once_and_ends_cleanly(tmp_path, number):
    link = tmp_path / "arm"
    command = [sys.executable, "-m", "fabric_dobot_driver.emulator", "--link", str(link)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().strip() == os.readlink(link)
        told = subprocess.run([*command, "--tell", "state"], capture_output=True, text=True)
        assert json.loads(told.stdout)["moving"] is False
        process.send_signal(number)
        assert process.wait(LIMIT) == 0
    assert not list(tmp_path.iterdir())
