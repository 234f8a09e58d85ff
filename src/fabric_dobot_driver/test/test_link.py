# SPDX-License-Identifier: BSD-3-Clause
"""The serial line on a pseudo-terminal: control lines, time-outs, garbage, a pulled plug."""

import os
import threading
import time
import tty
from contextlib import contextmanager

import pytest
import serial
from pydobotlab.protocol import pack

from fabric_dobot_driver.link import AUTO, LinkLost, NoAnswer, SerialLink

POSE = 10
TIMEOUT = 0.1


@contextmanager
def arm(answer):
    """A pty; what comes in is handed to answer(data), and what that returns goes out."""
    master, slave = os.openpty()
    tty.setraw(slave)

    def serve():
        while True:
            try:
                os.write(master, answer(os.read(master, 1000)))
            except OSError:
                return

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave), master
    finally:
        os.close(slave)
        thread.join(5.0)
        os.close(master)


@contextmanager
def opened(answer):
    with arm(answer) as (name, _):
        link = SerialLink(name, TIMEOUT)
        link.open()
        try:
            yield link
        finally:
            link.close()


def ask(link):
    return link.exchange(POSE, b"", write=False, queued=False)


def test_an_answer_comes_back():
    with opened(lambda data: pack(POSE, 0, b"position")) as link:
        assert ask(link) == b"position"


def test_noise_before_the_answer_is_passed_over():
    with opened(lambda data: b"\x01\xaa\x02" + pack(POSE, 0, b"position")) as link:
        assert ask(link) == b"position"


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        pack(POSE, 0, b"position")[:-3],
        pack(POSE, 0, b"position")[:-1] + b"\x00",
        pack(POSE + 1, 0, b"position"),
        b"\xaa\xaa\x01\x0a\xf6",
        b"\xaa\xaa\x00\x00",
    ],
    ids=["silence", "cut", "checksum", "other command", "too short", "empty"],
)
def test_no_answer_or_a_damaged_one_is_told_in_time(answer):
    with opened(lambda data: answer) as link, pytest.raises(NoAnswer):
        ask(link)


def test_an_endless_stream_of_garbage_does_not_hang():
    with arm(lambda data: b"") as (name, master):
        link = SerialLink(name, TIMEOUT)
        link.open()
        over = threading.Event()

        def babble():
            while not over.is_set():
                os.write(master, b"\x55" * 64)

        thread = threading.Thread(target=babble, daemon=True)
        thread.start()
        begun = time.monotonic()
        with pytest.raises(NoAnswer):
            ask(link)
        assert time.monotonic() - begun < 20 * TIMEOUT
        over.set()
        link.close()
        thread.join(0.1)  # it may hang in a full pty until that is closed


def test_a_pulled_plug_is_a_lost_link():
    master, slave = os.openpty()
    tty.setraw(slave)
    link = SerialLink(os.ttyname(slave), TIMEOUT)
    link.open()
    os.close(slave)
    os.close(master)
    with pytest.raises(LinkLost, match="the arm's port is gone"):
        ask(link)
    link.close()


def test_a_port_that_is_not_there_is_a_lost_link():
    with pytest.raises(LinkLost, match="/dev/no_such_port"):
        SerialLink("/dev/no_such_port", TIMEOUT).open()


def test_a_port_in_use_is_refused():
    with arm(lambda data: b"") as (name, _):
        first = SerialLink(name, TIMEOUT)
        first.open()
        with pytest.raises(LinkLost, match="busy"):
            SerialLink(name, TIMEOUT).open()
        first.close()


def test_control_lines_are_low_before_the_port_opens(monkeypatch):
    seen = []

    class Port(serial.Serial):
        def open(self):
            seen.append((self.is_open, self.dtr, self.rts))
            super().open()

    monkeypatch.setattr(serial, "Serial", Port)
    with opened(lambda data: b""):
        assert seen == [(False, False, False)]


def test_auto_tells_what_it_looked_for(monkeypatch):
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    with pytest.raises(LinkLost, match="no adapter 10C4:EA60, 1A86:7523 is plugged in"):
        SerialLink(AUTO, TIMEOUT).open()


@pytest.mark.parametrize("ids", [(0x10C4, 0xEA60), (0x1A86, 0x7523)])
def test_auto_finds_the_arm_behind_either_adapter(monkeypatch, ids):
    answers = {0: b"SERIAL", 2: b"\x03\x07\x00", POSE: bytes(32)}

    def answer(data):
        return pack(data[3], 0, answers[data[3]])

    with arm(answer) as (name, _):

        class Found:
            device, description, serial_number = name, "adapter", None
            vid, pid = ids

        monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [Found])
        link = SerialLink(AUTO, TIMEOUT)
        assert link.open() == name
        assert ask(link) == bytes(32)
        link.close()
