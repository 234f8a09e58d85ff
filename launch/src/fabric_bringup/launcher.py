# SPDX-License-Identifier: BSD-3-Clause
"""Runs a launch file for `./fabric`: a master of its own, quiet output, signals passed on once.

`python3 -m fabric_bringup.launcher sim|replay|perceive name:=value ...` with words checked before.
All that roslaunch and the nodes say is in log/roslaunch.log of out_dir; on the screen its chatter
is left out.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from fabric_bringup import outcome, ports

ESCAPES = re.compile(r"\x1b\[[0-9;]*m|\x1b\][^\x07]*\x07")
CHATTER = re.compile(
    r"""\.\.\.\ logging\ to\ |started\ roslaunch\ server|auto-starting\ new\ master
    |process\[[\w-]+\]:\ started|ROS_MASTER_URI=|setting\ /run_id|started\ core\ service
    |=*REQUIRED\ process\ \[(session|replay|perceive|latency)-|process\ has\ finished\ cleanly|=+$
    |Initiating\ shutdown!
    |(\s*\[[\w-]+\]\ killing\ on\ exit)+$|shutting\ down\ processing\ monitor
    |\.\.\.\ shutting\ down\ processing|done$|log\ file:\ |XDG_RUNTIME_DIR|QStandardPaths""",
    re.VERBOSE,
)


def spoken(lines: Iterable[str]) -> Iterator[str]:
    """The lines worth a reader's time: without roslaunch's chatter and repeated blank lines."""
    blank = True
    for line in lines:
        plain = ESCAPES.sub("", line)
        if CHATTER.match(plain) or (blank and not plain.strip()):
            continue
        blank = not plain.strip()
        yield plain


def environment(port: int, log: Path) -> dict[str, str]:
    """That of this process, with the graph's own master; names stay on this machine unless told."""
    mine = dict(os.environ, ROS_MASTER_URI=f"http://localhost:{port}", ROS_LOG_DIR=str(log))
    if "ROS_IP" not in mine:
        mine.setdefault("ROS_HOSTNAME", "localhost")
    return mine


def run(launch_file: str, words: Sequence[str], log: Path) -> int:
    """roslaunch to its end; its exit code, or 128 + the signal that somebody sent us."""
    with ports.claimed() as port:
        print(f"fabric: ROS master on port {port}", file=sys.stderr)
        return _roslaunch(port, launch_file, words, log)


def _roslaunch(port: int, launch_file: str, words: Sequence[str], log: Path) -> int:
    command = ["roslaunch", "--no-summary", "--disable-title", "--skip-log-check", "-p", str(port)]
    process = subprocess.Popen(
        [*command, "fabric_bringup", launch_file, *words],
        env=environment(port, log),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,  # a terminal's Ctrl-C reaches us only, and we pass it on
    )
    received: list[int] = []

    def pass_on(number: int, _: object) -> None:
        received.append(number)
        process.send_signal(signal.SIGINT)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, pass_on)
    with (log / "roslaunch.log").open("w") as whole:
        for line in spoken(copied(process.stdout, whole.write)):
            print(line, end="", flush=True)
    code = process.wait()
    return 128 + received[0] if received else code


def copied(lines: Iterable[str], write: Callable[[str], object]) -> Iterator[str]:
    """The same lines, each written on its way."""
    for line in lines:
        write(line)
        yield line


def replayed(folder: Path, code: int) -> int:
    """A replay is complete when its summary is there, which is written last."""
    if code == 0 and not (folder / "replay.json").exists():
        print("fabric: the replay did not come to its end", file=sys.stderr)
        return 1
    return code


def perceived(folder: Path, code: int) -> int:
    """As `replayed`, of pictures."""
    if code == 0 and not (folder / "perceive.json").exists():
        print("fabric: the pictures were not replayed to their end", file=sys.stderr)
        return 1
    return code


JUDGES: Mapping[str, Callable[[Path, int], int]] = {
    "sim": outcome.main,
    "replay": replayed,
    "perceive": perceived,
}


def main(job: str, words: Sequence[str]) -> int:
    """Run a job in its out_dir; the exit code of `./fabric`."""
    folder = Path(dict(word.split(":=", 1) for word in words)["out_dir"])
    log = folder / "log"
    try:
        log.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        print(f"fabric: out_dir:={folder} cannot be made: {error}", file=sys.stderr)
        return 2
    return JUDGES[job](folder, run(f"{job}.launch", words, log))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
