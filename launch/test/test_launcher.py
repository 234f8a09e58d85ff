# SPDX-License-Identifier: BSD-3-Clause
"""The launcher: what it shows, what it starts, how it judges."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

from fabric_bringup import launcher

SAID = """... logging to /somewhere/roslaunch.log
\x1b[1mstarted roslaunch server http://localhost:1/\x1b[0m
auto-starting new master
\x1b[1mprocess[cell-2]: started with pid [1]\x1b[0m

task 1/2  success

measure   proactive
\x1b[31m==========REQUIRED process [session-8] has died!
process has finished cleanly
log file: /somewhere/session-8*.log
Initiating shutdown!
====================\x1b[0m
[markers-10] killing on exit
[task-6] killing on exit[motion-5] killing on exit
[cell-2] process has died [pid 2, exit code 1]
shutting down processing monitor...
\x1b[1mdone\x1b[0m
"""
WANTED = """task 1/2  success

measure   proactive
[cell-2] process has died [pid 2, exit code 1]
"""
FAKE_ROSLAUNCH = """#!{python}
import signal, sys
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
print("up", *sys.argv[1:], flush=True)
signal.pause()
"""


def test_chatter_is_left_out_and_deaths_are_not():
    assert "".join(launcher.spoken(SAID.splitlines(keepends=True))) == WANTED


def test_the_graph_gets_its_own_master_and_log(monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_MASTER_URI", "http://elsewhere:11311")
    monkeypatch.delenv("ROS_IP", raising=False)
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    mine = launcher.environment(12345, tmp_path)
    assert mine["ROS_MASTER_URI"] == "http://localhost:12345"
    assert mine["ROS_HOSTNAME"] == "localhost"
    assert mine["ROS_LOG_DIR"] == str(tmp_path)
    monkeypatch.setenv("ROS_IP", "10.0.0.1")
    assert "ROS_HOSTNAME" not in launcher.environment(12345, tmp_path)


def test_a_replay_without_its_summary_failed(tmp_path):
    assert launcher.replayed(tmp_path, 0) == 1
    (tmp_path / "replay.json").touch()
    assert launcher.replayed(tmp_path, 0) == 0
    assert launcher.replayed(tmp_path, 130) == 130


def test_a_signal_reaches_roslaunch_and_gives_the_exit_code(tmp_path):
    fake = tmp_path / "roslaunch"
    fake.write_text(FAKE_ROSLAUNCH.format(python=sys.executable))
    fake.chmod(0o755)
    out = tmp_path / "out"
    paths = os.pathsep.join(path for path in sys.path if path)
    process = subprocess.Popen(
        [sys.executable, "-m", "fabric_bringup.launcher", "replay", f"out_dir:={out}"],
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert "replay.launch" in process.stdout.readline()
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert (out / "log/roslaunch.log").read_text().startswith("up")
