# SPDX-License-Identifier: BSD-3-Clause
"""What the value of each word must be: text in, the text for roslaunch out, or ArgumentError.

Needs the standard library only, as `arguments` does.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
import re
import socket
from collections.abc import Callable, Sequence

SCENARIOS = ("inspection", "sorting")
TASK_TYPES = ("type_1_colours", "type_2_sequence", "type_3_mixed", "type_4_memory", "type_5_stroop")
TASKS = {name: name for name in SCENARIOS} | dict.fromkeys(TASK_TYPES, "sorting")  # of scenarios
POLICIES = ("abps", "proactive", "patient", "eager", "reactive", "on_call", "none")
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


tasks = functools.partial(_integer, least=1)  # how many
seed = functools.partial(_integer, least=0)  # root of all randomness


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


def one_of(allowed: Sequence[str]) -> Callable[[str], str]:
    """A check that takes exactly the words of `allowed`."""

    def check(text: str) -> str:
        if text not in allowed:
            raise ArgumentError(f"one of {', '.join(allowed)}")
        return text

    return check


boolean = one_of(("true", "false"))  # as roslaunch wants them
sensing = one_of(("direct", "camera"))  # how the person is seen


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


def task(text: str) -> str:
    """A task definition by name, or the absolute path of a YAML file that exists, or empty."""
    if text.endswith(".yaml") and os.path.isfile(text):
        return os.path.abspath(text)
    return text and one_of((*TASKS, "a .yaml file that exists"))(text)


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
