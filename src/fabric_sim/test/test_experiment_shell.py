# SPDX-License-Identifier: BSD-3-Clause
"""What the experiments print, and to whom."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fabric_sim.experiments.shell import tell

LINES = [{"policy": "proactive", "reward": 4.5}, {"policy": "none", "reward": None}]
TELL = """
import sys
from fabric_sim.experiments.shell import tell
tell("a table\\n" * int(sys.argv[1]), [{"a": 1}] * int(sys.argv[1]), ["x"], sys.argv[2] == "json")
"""


def test_tables_are_for_people_and_lines_for_programs(capsys) -> None:
    tell("a table", LINES, [Path("report.html")], as_json=False)
    assert capsys.readouterr().out == "a table\nwrote report.html\n"
    tell("a table", LINES, [Path("report.html")], as_json=True)
    told = capsys.readouterr()
    assert [json.loads(line) for line in told.out.splitlines()] == LINES
    assert told.err == "wrote report.html\n"


@pytest.mark.parametrize("kind", ["text", "json"])
@pytest.mark.parametrize("length", [1, 100_000], ids=["short", "longer than a pipe"])
def test_a_reader_who_has_seen_enough_ends_the_telling_quietly(length, kind) -> None:
    reads, writes = os.pipe()
    os.close(reads)
    command = [sys.executable, "-c", TELL, str(length), kind]
    told = subprocess.run(command, stdout=writes, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writes)
    assert told.returncode == 0
    assert "Broken" not in told.stderr and "Traceback" not in told.stderr
