# SPDX-License-Identifier: BSD-3-Clause
"""The words of `./fabric sim` and `./fabric batch`."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from fabric_bringup import arguments


def refused(*words: str) -> str:
    with pytest.raises(arguments.ArgumentError) as caught:
        arguments.parse("sim", words)
    return str(caught.value)


@pytest.mark.parametrize(
    "word",
    [
        "policy:=nonsense",
        "human:=nobody",
        "scenario:=moon",
        "tasks:=-3",
        "tasks:=abc",
        "tasks:=0",
        "tasks:=",
        "tasks:=²",
        "tasks:=99999999999",
        "seed:=-1",
        "seed:=1.5",
        "sensing:=smell",
        "speed:=nan",
        "speed:=0",
        "web_port:=65536",
        "web_port:=-1",
        "rviz:=yes",
        "person:=Ann Smith",
        "person:=../P07",
        "selector:=nowhere.yaml",
        "human:=0.1,0.2,0.3",
        "human:=0.1,0.2,0.3,nan",
        "human:=0.1,0.2,0.3,1.01",
        "policy:=nowhere/none.pomdpx",
    ],
)
def test_a_bad_value_is_refused_by_name(word):
    name, _, value = word.partition(":=")
    reason = refused(word)
    assert f"{name}:={value} is refused" in reason
    assert "must be" in reason


def test_the_refusal_of_a_human_lists_the_sixteen_types():
    reason = refused("human:=nobody")
    assert len(arguments.HUMAN_TYPES) == 16
    assert all(name in reason for name in arguments.HUMAN_TYPES)


def test_people_are_seen_by_labels_or_by_cameras():
    assert arguments.parse("sim", ["sensing:=camera"])["sensing"] == "camera"
    assert "one of direct, camera" in refused("sensing:=radar")


def test_a_worker_is_a_file_that_exists(tmp_path, monkeypatch):
    assert "a model file that exists" in refused("human:=somebody.pomdpx")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "somebody.pomdpx").touch()
    for command in ("sim", "batch"):
        said = arguments.parse(command, ["human:=somebody.pomdpx"])
        assert said["human"] == str(tmp_path / "somebody.pomdpx")


def test_a_person_at_the_keys_gets_real_time_and_never_the_fastest():
    assert arguments.parse("sim", ["human:=manual"])["speed"] == "1.0"
    assert arguments.parse("sim", ["human:=manual", "speed:=2"])["speed"] == "2.0"
    assert arguments.parse("sim", ["human:=mixed"])["speed"] == "0"
    assert "nobody presses keys" in refused("human:=manual", "speed:=max")


def test_a_port_in_use_is_refused():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        number = taken.getsockname()[1]
        assert "a port that is free" in refused(f"web_port:={number}")


def test_a_headless_run_has_nobody_at_the_keys():
    with pytest.raises(arguments.ArgumentError, match="somebody at the keys: ./fabric sim"):
        arguments.parse("batch", ["human:=manual"])


def test_an_unknown_name_and_a_word_without_sign_are_refused():
    assert "unknown argument 'colour'" in refused("colour:=red")
    assert "'tasks=3' is not of the form name:=value" in refused("tasks=3")
    assert "given twice" in refused("tasks:=3", "tasks:=4")


def test_defaults_fill_in_what_is_not_said():
    said = arguments.parse("sim", ["tasks:=007"])
    assert said["tasks"] == "7"
    assert said["scenario"] == "inspection"
    assert list(said) == list(arguments.words_of("sim"))


@pytest.mark.parametrize("human", ["random", "mixed", "0.3,0.8,0.5,0.1", arguments.HUMAN_TYPES[5]])
def test_people_are_taken_as_they_are_said(human):
    assert arguments.parse("sim", [f"human:={human}"])["human"] == human


def test_model_files_and_folders_become_absolute(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.POMDPx").touch()
    said = arguments.parse("sim", ["policy:=mine.POMDPx", "out_dir:=there"])
    assert said["policy"] == str(tmp_path / "mine.POMDPx")
    assert said["out_dir"] == str(tmp_path / "there")


def test_a_folder_that_holds_a_run_is_refused(tmp_path):
    (tmp_path / "run.json").touch()
    assert "run.json" in refused(f"out_dir:={tmp_path}")


def test_two_runs_in_one_second_get_two_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first = arguments.new_run_folder()
    for number in ("", "_2", "_3"):
        (tmp_path / (first + number)).mkdir(parents=True)
    later = arguments.new_run_folder()
    assert not (tmp_path / later).exists()


def test_the_script_needs_nothing_but_the_standard_library():
    alone = {"PYTHONPATH": str(Path(arguments.__file__).parents[1])}
    command = [sys.executable, "-s", "-S", "-B", "-m", arguments.__name__, "batch", "tasks:=5"]
    told = subprocess.run(command, capture_output=True, text=True, check=True, env=alone)
    assert told.stdout.splitlines()[0] == "tasks:=5"
    assert "rviz" not in told.stdout


def test_replay_takes_a_recording_that_exists_and_a_policy_that_decides_alone(tmp_path):
    trial = tmp_path / "trial.csv"
    trial.touch()
    said = arguments.parse("replay", [f"file:={trial}", "policy:=reactive", "speed:=0"])
    assert (said["file"], said["policy"], said["speed"]) == (str(trial), "reactive", "0")
    for word in ("file:=gone.csv", f"file:={tmp_path}", "policy:=abps", "speed:=-1"):
        with pytest.raises(arguments.ArgumentError, match=word + " is refused"):
            arguments.parse(
                "replay", [word] if word.startswith("file") else [f"file:={trial}", word]
            )
    with pytest.raises(arguments.ArgumentError, match="file:= is refused"):
        arguments.parse("replay", [])


def test_the_scheduler_of_a_training_may_be_given_as_an_option(capsys):
    for words in (["--scheduler", "a.b:8786"], ["--scheduler=a.b:8786"], ["scheduler:=a.b:8786"]):
        assert arguments.main(["train", *words]) == 0
        assert "scheduler:=a.b:8786" in capsys.readouterr().out.splitlines()
    assert arguments.main(["train", "--scheduler"]) == 2
    assert "--scheduler wants a value" in capsys.readouterr().err
    assert arguments.main(["sim", "--scheduler", "a.b:8786"]) == 2


@pytest.mark.parametrize("address", ["here", "host:", ":8786", "host:0", "host:70000", "a b:1"])
def test_a_scheduler_is_a_host_and_a_port(address):
    with pytest.raises(arguments.ArgumentError, match="host:port of a Dask scheduler"):
        arguments.parse("train", [f"scheduler:={address}"])


def test_a_task_by_name_brings_its_scenario():
    assert arguments.parse("sim", ["task:=type_4_memory"])["scenario"] == "sorting"
    assert arguments.parse("batch", ["task:=inspection"])["scenario"] == "inspection"
    assert arguments.parse("sim", [])["task"] == ""
    told = refused("scenario:=inspection", "task:=type_4_memory")
    assert told == "scenario:=inspection does not go with task:=type_4_memory"


def test_a_task_is_a_name_or_a_file_that_exists(tmp_path):
    path = tmp_path / "mine.yaml"
    assert "type_5_stroop, a .yaml file that exists" in refused("task:=type_6")
    assert "a .yaml file that exists" in refused(f"task:={path}")
    path.touch()
    assert arguments.parse("sim", [f"task:={path}"])["task"] == str(path)


def test_a_rehearsal_takes_a_protocol_by_name_or_by_file(tmp_path):
    own = tmp_path / "own.yaml"
    own.touch()
    for said, meant in (("experiment-1", "experiment-1"), (str(own), str(own))):
        assert arguments.parse("rehearse", [f"protocol:={said}"])["protocol"] == meant
    for said in ("experiment-9", "nowhere.yaml", ""):
        with pytest.raises(arguments.ArgumentError, match="one of experiment-0, experiment-1"):
            arguments.parse("rehearse", [f"protocol:={said}"])


def test_a_rehearsal_is_not_written_into_a_study(tmp_path):
    (tmp_path / "study.json").touch()
    words = ["protocol:=experiment-1", f"out_dir:={tmp_path}"]
    with pytest.raises(arguments.ArgumentError, match="holds no study yet"):
        arguments.parse("rehearse", words)


@pytest.mark.parametrize("word", ["people:=-1", "people:=few", "power:=1.5", "workers:=nan"])
def test_a_bad_number_of_a_rehearsal_is_refused_by_name(word):
    with pytest.raises(arguments.ArgumentError, match=f"{word} is refused"):
        arguments.parse("rehearse", ["protocol:=experiment-1", word])
