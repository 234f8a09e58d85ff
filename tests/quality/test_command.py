# SPDX-License-Identifier: BSD-3-Clause
"""./fabric, as far as it goes without a built workspace."""

from __future__ import annotations

import os
import subprocess

import pytest
import tree


def fabric(*words: str) -> subprocess.CompletedProcess:
    command = [str(tree.ROOT / "fabric"), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "word",
    ["policy:=nonsense", "human:=nobody", "scenario:=moon", "tasks:=-3", "sensing:=smell"],
)
def test_a_bad_argument_is_refused_with_2_before_anything_starts(word):
    told = fabric("sim", word)
    assert told.returncode == 2
    assert word in told.stderr
    assert told.stdout == ""


def test_unknown_commands_and_options_are_refused_by_name():
    for words in (["dance"], ["test", "--slow"], ["test", "--repeat", "x"], ["bench", "speed"]):
        told = fabric(*words)
        assert told.returncode == 2
        assert f"'{words[-1]}'" in told.stderr


def test_help_offers_only_what_is_there():
    told = fabric("help").stdout
    for name in ("setup", "sim", "test", "bench", "replay", "doctor", "shell"):
        assert f"  {name}" in told
    for name, module in (("emulator", "src/fabric_dobot_driver/src/fabric_dobot_driver/emulator"),):
        assert (f"  {name}" in told) == (tree.ROOT / module / "__main__.py").exists()


def test_help_of_a_command_lists_its_words():
    told = fabric("sim", "--help").stdout
    for name in ("tasks", "seed", "scenario", "human", "policy", "speed", "rviz", "out_dir"):
        assert f"{name}:=" in told


def test_the_command_can_be_called_from_anywhere(tmp_path):
    link = tmp_path / "fabric"
    os.symlink(tree.ROOT / "fabric", link)
    told = subprocess.run([str(link), "help"], cwd=tmp_path, capture_output=True, text=True)
    assert "usage: ./fabric" in told.stdout


def test_doctor_answers_every_question(tmp_path):
    told = fabric("doctor").stdout
    assert "Debian" in told
    assert "venv" in told


def test_studies_refuse_words_that_they_do_not_know():
    for words, named in (
        (["study", "dance"], "'dance'"),
        (["study", "rehearse"], "wants a protocol"),
        (["study", "rehearse", "experiment-9"], "protocol:=experiment-9 is refused"),
        (["study", "rehearse", "experiment-1", "people:=-3"], "people:=-3 is refused"),
    ):
        told = fabric(*words)
        assert told.returncode == 2
        assert named in told.stderr
        assert told.stdout == ""


def test_a_study_tells_what_can_be_done():
    assert fabric("study").returncode == 2
    told = fabric("study", "help")
    assert told.returncode == 0
    for word in ("console", "rehearse", "verify", "export"):
        assert f"  {word}" in told.stdout
    assert "people:=" in fabric("study", "rehearse", "--help").stdout
