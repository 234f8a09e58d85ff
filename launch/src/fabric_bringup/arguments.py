# SPDX-License-Identifier: BSD-3-Clause
"""The words every FABRIC command understands, `name:=value`, checked before anything starts.

Needs the standard library only: `./fabric` refuses a bad value before the workspace is built.
"""

from __future__ import annotations

import dataclasses
import datetime
import itertools
import os
import sys
from collections.abc import Callable, Sequence

from fabric_bringup.checks import (
    HUMAN_TYPES,
    MANUAL,
    POLICIES,
    PROTOCOLS,
    SCENARIOS,
    TASK_TYPES,
    TASKS,
    ArgumentError,
    boolean,
    camera_files,
    folder,
    human,
    one_of,
    out_dir,
    person,
    policies,
    policy,
    port,
    protocol,
    recording,
    replay_policy,
    replay_speed,
    scheduler,
    seed,
    sensing,
    settings,
    simulated_human,
    speed,
    study_dir,
    task,
    tasks,
)


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
    Word("task", "", f"of the scenario: {' | '.join(TASK_TYPES)} | a .yaml file", task),
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
    implied = TASKS.get(given.get("task", ""))
    if implied and given.setdefault("scenario", implied) != implied:
        raise ArgumentError(f"scenario:={given['scenario']} does not go with task:={given['task']}")
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
    """`COMMAND [name:=value ...]` prints every checked word; exit 2 on refusal."""
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
