#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The words every FABRIC command understands, `name:=value`, checked before anything starts.

Needs the standard library only: `./fabric` refuses a bad value before the workspace is built.
"""

from __future__ import annotations

import dataclasses
import datetime
import itertools
import math
import os
import re
import socket
import sys
from collections.abc import Callable, Sequence

SCENARIOS = ("inspection", "sorting")
POLICIES = ("abps", "proactive", "patient", "eager", "reactive", "none")
REPLAY_POLICIES = ("proactive", "patient", "eager", "reactive")
RECORDING_SUFFIXES = (".csv", ".bag")
PROTOCOLS = ("experiment-0", "experiment-1", "experiment-2")  # of fabric_study
HUMAN_TYPES = tuple(
    "_".join(corner)
    for corner in itertools.product(
        ("beginner", "expert"),
        ("tired", "rested"),
        ("distracted", "attentive"),
        ("collaborative", "noncollaborative"),
    )
)
MODEL_SUFFIXES = (".pomdpx", ".pomdp")
PERSON = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")  # a person's code, as in fabric_abps
MANUAL = "manual"  # the value of human that stands for somebody at the keys
LARGEST_INT = 2**31 - 1  # what a ROS parameter can hold


class ArgumentError(ValueError):
    """A word that is refused; the message names it, its value and what is allowed."""


def _integer(text: str, least: int) -> str:
    if not text.isascii() or not text.isdigit() or not least <= int(text) <= LARGEST_INT:
        raise ArgumentError(f"a whole number from {least} to {LARGEST_INT}")
    return str(int(text))


def tasks(text: str) -> str:
    """A positive number of tasks."""
    return _integer(text, 1)


def seed(text: str) -> str:
    """A root seed, 0 or more."""
    return _integer(text, 0)


def port(text: str) -> str:
    """A TCP port that is free on this machine, or 0 for any."""
    number = int(_integer(text, 0))
    if number > 65535:
        raise ArgumentError("a whole number from 0 to 65535")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", number))
        except OSError as error:
            raise ArgumentError(f"a port that is free ({error.strerror})") from None
    return str(number)


def boolean(text: str) -> str:
    """true or false, as roslaunch wants them."""
    return one_of(("true", "false"))(text)


def one_of(allowed: Sequence[str]) -> Callable[[str], str]:
    """A check that takes exactly the words of `allowed`."""

    def check(text: str) -> str:
        if text not in allowed:
            raise ArgumentError(f"one of {', '.join(allowed)}")
        return text

    return check


def speed(text: str) -> str:
    """Times real time, above 0; `max` is as fast as the computer can."""
    if text == "max":
        return "0"
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and 0 < value <= 1000):
        raise ArgumentError("a number above 0 up to 1000 (times real time), or max")
    return repr(value)


def _model_file(text: str) -> str | None:
    """Absolute path if `text` looks like a model file; one that is not there is refused."""
    if not text.lower().endswith(MODEL_SUFFIXES):
        return None
    if not os.path.isfile(text):
        raise ArgumentError("a model file that exists")
    return os.path.abspath(text)


def _dials(text: str) -> str | None:
    """Four numbers e,s,a,c in [0, 1] (expertise, stamina, attention, collaborativeness)."""
    parts = text.split(",")
    if len(parts) == 1:
        return None
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) != 4 or not all(0.0 <= value <= 1.0 for value in values):
        raise ArgumentError("four numbers in [0, 1]: expertise,stamina,attention,collaborativeness")
    return text


def simulated_human(text: str) -> str:
    """A known type, four dials, random (one a run), mixed (one a task), drifting, or a file."""
    file = _model_file(text)
    if file is not None:
        return file
    if _dials(text) is not None or text in HUMAN_TYPES + ("random", "mixed", "drifting"):
        return text
    if text == MANUAL:
        raise ArgumentError("a simulated person (manual needs somebody at the keys: ./fabric sim)")
    raise ArgumentError(
        "random, mixed, drifting, four numbers e,s,a,c in [0, 1], a model file (.pomdpx), or one "
        "of the types " + ", ".join(HUMAN_TYPES)
    )


def human(text: str) -> str:
    """As simulated_human, or manual: somebody at the keys."""
    return text if text == MANUAL else simulated_human(text)


def policy(text: str) -> str:
    """A policy by name, or a decision model file."""
    return _model_file(text) or one_of((*POLICIES, "a model file (.pomdpx)"))(text)


def replay_policy(text: str) -> str:
    """A policy that decides alone, by name, or a decision model file."""
    return _model_file(text) or one_of((*REPLAY_POLICIES, "a model file (.pomdpx)"))(text)


def replay_speed(text: str) -> str:
    """As speed; 0 is another word for max."""
    return "0" if text == "0" else speed(text)


def recording(text: str) -> str:
    """Absolute path of a recorded trial."""
    if not text.lower().endswith(RECORDING_SUFFIXES) or not os.path.isfile(text):
        raise ArgumentError("a recorded trial that exists (.csv or .bag)")
    return os.path.abspath(text)


def camera_files(text: str) -> str:
    """Absolute paths of YAML files, colon between; empty stays empty."""
    return ":".join(settings(part) for part in text.split(":")) if text else ""


def policies(text: str) -> str:
    """Policies to compare, comma between."""
    checked = [policy(part) for part in text.split(",")]
    if len(set(checked)) < len(checked):
        raise ArgumentError("policies that differ")
    return ",".join(checked)


def sensing(text: str) -> str:
    """How the person is seen."""
    return one_of(("direct", "camera"))(text)


def scheduler(text: str) -> str:
    """host:port of a Dask scheduler, or empty."""
    address = text.removeprefix("tcp://").removeprefix("tls://")
    host, sign, number = address.rpartition(":")
    valid = host and sign and number.isascii() and number.isdigit() and 0 < int(number) < 65536
    if text and (not valid or not text.isprintable() or " " in text):
        raise ArgumentError("host:port of a Dask scheduler, e.g. 10.0.0.5:8786")
    return text


def folder(text: str) -> str:
    """Absolute path of a folder, which may be there; empty stays empty."""
    path = os.path.abspath(os.path.expanduser(text)) if text else ""
    if "\n" in path or (path and os.path.exists(path) and not os.path.isdir(path)):
        raise ArgumentError("a folder, not a file")
    return path


def settings(text: str) -> str:
    """Absolute path of a YAML file that exists; empty stays empty."""
    if text and not (text.endswith((".yaml", ".yml")) and os.path.isfile(text)):
        raise ArgumentError("a YAML file that exists")
    return os.path.abspath(text) if text else ""


def person(text: str) -> str:
    """Empty, or the code of a person: letters, digits, - and _, 32 at most."""
    if text and not PERSON.fullmatch(text):
        raise ArgumentError("a code of 1 to 32 letters, digits, - and _, such as P07 (no name)")
    return text


def protocol(text: str) -> str:
    """A shipped protocol by name, or the absolute path of a YAML file."""
    if text.endswith(".yaml") and os.path.isfile(text):
        return os.path.abspath(text)
    return one_of((*PROTOCOLS, "a YAML file that exists"))(text)


def study_dir(text: str) -> str:
    """Absolute folder of a study; one that already holds a study or a run is refused."""
    path = out_dir(text)
    for name in ("study.json", "study.sqlite"):
        if os.path.exists(os.path.join(path, name)):
            raise ArgumentError(f"a folder that holds no study yet (this one has a {name})")
    return path


def out_dir(text: str) -> str:
    """Absolute folder of the record; one that already holds a run is refused."""
    if not text or "\n" in text:
        raise ArgumentError("the path of a folder")
    path = os.path.abspath(os.path.expanduser(text))
    if os.path.exists(path) and not os.path.isdir(path):
        raise ArgumentError("a folder, not a file")
    if os.path.exists(os.path.join(path, "run.json")):
        raise ArgumentError("a folder that holds no run yet (this one has a run.json)")
    return path


def new_run_folder() -> str:
    """runs/<date>_<time> below the working folder, with a suffix when it is taken."""
    stamp = datetime.datetime.now().strftime("%Y%m%d_%H%M%S")
    for suffix in itertools.chain([""], (f"_{number}" for number in itertools.count(2))):
        path = os.path.join("runs", stamp + suffix)
        if not os.path.exists(path):
            return path
    raise AssertionError("unreachable: count() does not end")


REPLAYS = ("replay", "perceive")  # of decisions, and of pictures before
PEOPLE = "a type | e,s,a,c | random | mixed | drifting | a model file"


@dataclasses.dataclass(frozen=True)
class Word:
    """One argument; `check` turns its text into the text for roslaunch or raises ArgumentError."""

    name: str
    default: str | Callable[[], str]
    meaning: str
    check: Callable[[str], str]
    commands: tuple[str, ...] = ("sim", "batch")


WORDS = (
    Word("tasks", "10", "how many tasks to run", tasks),
    Word("seed", "1", "root of all randomness; same seed, same results", seed),
    Word("scenario", "inspection", "inspection | sorting", one_of(SCENARIOS)),
    Word("human", "random", f"{PEOPLE} | manual (you)", human, ("sim",)),
    Word("human", "random", PEOPLE, simulated_human, ("batch",)),
    Word("policy", "proactive", f"{' | '.join(POLICIES)} | a model file", policy, ("sim",)),
    Word("policy", "proactive", "one or several as for sim, comma between", policies, ("batch",)),
    Word("seeds", "1", "how many runs a policy, with seeds from seed on", tasks, ("batch",)),
    Word("tasks", "90", "how many tasks a policy and type of person", tasks, ("train",)),
    Word("seed", "1", "root of all randomness; same seed, same models", seed, ("train",)),
    Word("scenario", "inspection", "inspection | sorting", one_of(SCENARIOS), ("train",)),
    Word("policies", "20", "of a new library", tasks, ("train",)),
    Word(
        "library",
        "new",
        "new: build it; keep: train on the policies there, e.g. with your own",
        one_of(("new", "keep")),
        ("train",),
    ),
    Word("scheduler", "", "host:port of a Dask scheduler; empty is here", scheduler, ("train",)),
    Word("out_dir", "", "folder of the libraries; empty is where ABPS looks", folder, ("train",)),
    Word("jobs", "0", "processes; 0 is one a core", seed, ("batch", "train")),
    Word("library", "", "abps: folder of a trained library; empty is the shipped one", folder),
    Word("selector", "", "abps: a file in place of config/selector.yaml", settings),
    Word("person", "", "abps: code to keep what is learnt of them under, as P07", person, ("sim",)),
    Word("memory", "runs/people", "abps: folder of what is kept of persons", folder, ("sim",)),
    Word("sensing", "direct", "direct: labels with noise; camera: pictures", sensing),
    Word("speed", "max", "times real time, or max; manual: 1 unless given", speed, ("sim",)),
    Word("web_port", "0", "of the page for human:=manual; 0 is any free one", port, ("sim",)),
    Word("rviz", "false", "open the 3D view", boolean, ("sim",)),
    Word("record", "true", "one bag a task", boolean, ("sim",)),
    Word("pictures", "false", "bags with what cameras see, 30 MB a second", boolean, ("sim",)),
    Word("out_dir", new_run_folder, "folder of the record", out_dir),
    Word("file", "", "the recorded trial, a CSV file or a bag", recording, REPLAYS),
    Word(
        "policy",
        "proactive",
        "proactive | patient | eager | reactive | a model file",
        replay_policy,
        ("replay",),
    ),
    Word("speed", "max", "times the recorded time, or max", replay_speed, ("replay",)),
    Word("out_dir", "runs/replay", "folder of plot and summary", out_dir, REPLAYS),
    Word("protocol", "", "a shipped protocol or a YAML file", protocol, ("rehearse",)),
    Word("people", "0", "how many; 0 is as many as the protocol has", seed, ("rehearse",)),
    Word("seed", "1", "root of all randomness; same seed, same study", seed, ("rehearse",)),
    Word("power", "200", "people simulated for the power curves; 0: none", seed, ("rehearse",)),
    Word("workers", "0", "processes; 0 is one a core", seed, ("rehearse",)),
    Word("out_dir", new_run_folder, "folder of the study", study_dir, ("rehearse",)),
    Word("names", "", "topics of another driver, own=recorded,...", str, ("perceive",)),
    Word("camera_files", "", "where the cameras were, YAML:YAML", camera_files, ("perceive",)),
)


def words_of(command: str) -> dict[str, Word]:
    """The words that a command knows, in the order in which they are shown."""
    return {word.name: word for word in WORDS if command in word.commands}


def parse(command: str, arguments: Sequence[str]) -> dict[str, str]:
    """Checked value of every word of `command`, defaults filled in.

    Raises ArgumentError naming the word, the value and what is allowed.
    """
    known = words_of(command)
    given: dict[str, str] = {}
    for argument in arguments:
        name, sign, text = argument.partition(":=")
        if not sign:
            raise ArgumentError(f"'{argument}' is not of the form name:=value")
        if name not in known:
            raise ArgumentError(
                f"unknown argument '{name}' in '{argument}'; known are {', '.join(known)}"
            )
        if name in given:
            raise ArgumentError(f"'{name}' is given twice")
        given[name] = _checked(known[name], text)
    if given.get("human") == MANUAL and given.setdefault("speed", "1.0") == "0":
        raise ArgumentError(
            "speed:=max is refused: with human:=manual it must be a number above 0 (times real "
            "time), nobody presses keys as fast as the computer"
        )
    for name, word in known.items():
        if name not in given:
            given[name] = _checked(word, word.default() if callable(word.default) else word.default)
    return {name: given[name] for name in known}


def _checked(word: Word, text: str) -> str:
    try:
        return word.check(text)
    except ArgumentError as reason:
        raise ArgumentError(f"{word.name}:={text} is refused: it must be {reason}") from None


def with_words(arguments: Sequence[str], *names: str) -> list[str]:
    """`--name VALUE` and `--name=VALUE` of these names written as name:=VALUE."""
    result, rest = [], list(arguments)
    while rest:
        argument = rest.pop(0)
        option, sign, value = argument.partition("=")
        if argument.startswith("--") and option[2:] in names:
            value = value if sign else rest.pop(0) if rest else ""
            if not value:
                raise ArgumentError(f"{option} wants a value")
            argument = f"{option[2:]}:={value}"
        result.append(argument)
    return result


NOTES = {  # what else a command takes
    "rehearse": [
        f"protocol:= may be left out before the name or path; there are {', '.join(PROTOCOLS)}",
        "the people, their work and their answers are simulated; nothing is said about real ones",
    ],
    "train": ["--scheduler HOST:PORT is another way to write scheduler:=HOST:PORT"],
    "replay": [
        "file:= may be left out before the path; unless given, out_dir is runs/replay-NAME",
        "with a folder of trials in its place: ./fabric replay FOLDER [out_dir:=DIR] [seed:=1]",
        "a bag with pictures goes through perception first; it also takes names:=own=recorded,... "
        "and camera_files:=YAML:YAML (docs/cameras.md)",
    ],
}


SPELT = {"rehearse": "study rehearse PROTOCOL"}  # where the command has more than one word


def usage(command: str) -> str:
    """One line a word, with its default."""
    lines = [f"usage: ./fabric {SPELT.get(command, command)} [name:=value ...]"]
    for word in words_of(command).values():
        default = "runs/<date>_<time>" if callable(word.default) else word.default
        lines.append(f"  {word.name + ':=' + default:<32} {word.meaning}")
    if "human" in words_of(command):
        lines.append("types of people: " + ", ".join(HUMAN_TYPES))
    return "\n".join(lines + NOTES.get(command, []))


def main(arguments: Sequence[str]) -> int:
    """`arguments.py COMMAND [name:=value ...]` prints every checked word; exit 2 on refusal."""
    command, *rest = arguments
    if rest == ["--help"]:
        print(usage(command))
        return 0
    try:
        rest = with_words(rest, "scheduler") if command == "train" else rest
        checked = parse(command, rest)
    except ArgumentError as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 2
    print("\n".join(f"{name}:={text}" for name, text in checked.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
