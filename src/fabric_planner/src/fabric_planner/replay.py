# SPDX-License-Identifier: BSD-3-Clause
"""Recorded trials as a row of Observation messages, with what the recorded robot did.

A CSV file holds one row an event, in order, with the columns of `COLUMNS`: `source` is manager,
observation (what was seen of the person), robot (its decision) or sensor (a cube reached a tray).
`looking_around` means what it says, 1 when the eyes are elsewhere: wherever the recorded symbol
tells attentive from looking around, attentive rows hold 0. `mapped_obs` is a symbol of the
recorded robot's own model and is used for nothing but to find the observation that announced a
placement (12 right, 13 wrong; a proactive robot's only).
"""

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import genpy

from fabric_msgs.msg import Decision, Observation

COLUMNS = (
    "time_s", "source", "looking_around", "detected", "grasp_attempt", "warning", "idle",
    "task_success", "task_failure", "mapped_obs", "robot_action", "subtask_status", "who",
)  # fmt: skip
BOOLEANS = COLUMNS[2:9]
ACTION_NAMES = {
    "idle": "idle",
    "planning": "planning",
    "planning for grasping": "planning",
    "point": "point",
    "point to remind human": "point",
    "grasp": "grasp",
    "cancel": "cancel",
    "cancel all actions": "cancel",
}
ACTIONS = ("idle", "planning", "point", "grasp", "cancel")  # order of Decision's constants
SOURCES = ("manager", "manager-task-done", "observation", "robot", "sensor")
ANNOUNCED = {"12": ("success", "human"), "13": ("fail", "human")}
# A tray reports a cube about 2.7 s after the hand has left it, rarely later than 4 s; only then is
# an attempt known to have failed. The recorder wrote a report up to 2 s after its observation.
REPORT_DELAY = 4.0
ANNOUNCE_WINDOW = 2.0


class ReplayError(ValueError):
    """A recording cannot be used; the message names file, line, column and value."""


@dataclass
class Step:
    """One observation, and the recorded robot's answer to it."""

    time: float  # s since the recording began
    observation: Observation
    recorded: str | None = None  # the robot's decision on it; None when it gave none
    in_force: str | None = None  # the robot's last decision up to and including this step
    subtask: int = 0  # number of the subtask it belongs to, from 1; a placement ends one
    seen: bool = True  # the person was looked at; False for a tray's report, the person as before

    @property
    def placement(self) -> bool:
        """A cube has reached a tray."""
        o = self.observation
        return o.subtask_success or o.subtask_failure or o.robot_success or o.robot_failure

    @property
    def decides_for(self) -> int:
        """Number of the subtask a decision on this observation is about."""
        return self.subtask + self.placement

    @property
    def final(self) -> bool:
        """The task is over."""
        return self.observation.task_success or self.observation.task_failure


@dataclass
class Recording:
    """A recorded task."""

    name: str
    robot: str  # the recorded robot: proactive, reactive or unknown
    scenario: str  # inspection or sorting
    steps: list[Step] = field(default_factory=list)


def read_csv(path: "str | Path") -> Recording:
    """Read a trial; raises ReplayError naming file, line, column and value."""
    path = Path(path)
    robot = re.search(r"(proactive|reactive)", path.stem)
    converter = _Converter(robot.group(1) if robot else "unknown")
    for line, row in _rows(path):
        try:
            converter.take(row)
        except ReplayError as error:
            raise ReplayError(f"{path}: line {line}: {error}") from None
    if not converter.steps:
        raise ReplayError(f"{path}: holds no observation")
    return _finish(Recording(path.stem, converter.robot, "sorting", converter.steps))


def from_messages(
    name: str,
    observations: Sequence[Observation],
    decisions: Iterable[Decision],
    scenario: str = "sorting",
    robot: str = "unknown",
) -> Recording:
    """A recording of our own: the messages of the topics observation and decision of one bag.

    Raises ReplayError when there is no observation, or their sequence does not rise.
    """
    if not observations:
        raise ReplayError(f"{name}: holds no message on a topic 'observation'")
    answers = {decision.observation_sequence: decision for decision in decisions}
    steps = []
    start = observations[0].header.stamp.to_sec()
    last = 0
    for observation in observations:
        if observation.sequence <= last:
            raise ReplayError(
                f"{name}: observation {observation.sequence} comes after observation {last}"
            )
        last = observation.sequence
        answer = answers.get(observation.sequence)
        recorded = ACTIONS[answer.action] if answer is not None else None
        steps.append(Step(observation.header.stamp.to_sec() - start, observation, recorded))
    return _finish(Recording(name, robot, scenario, steps))


def _finish(recording: Recording) -> Recording:
    """Number the observations from 1 without gaps, count subtasks, note the action in force."""
    in_force = None
    subtask = 1
    for number, step in enumerate(recording.steps, start=1):
        step.observation.sequence = number
        in_force = step.recorded or in_force
        step.in_force = in_force
        step.subtask = subtask
        subtask += step.placement
    return recording


def _rows(path: Path) -> Iterable[tuple[int, dict[str, str]]]:
    """Line number and fields of every row; checks the frame of the file."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ReplayError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ReplayError(f"{path}: is not a text file: {error.reason}") from error
    reader = csv.reader(text.splitlines())
    try:
        for row in reader:
            if reader.line_num == 1:
                _check_header(path, row)
            elif len(row) != len(COLUMNS):
                raise ReplayError(
                    f"{path}: line {reader.line_num}: has {len(row)} fields, not {len(COLUMNS)}"
                )
            else:
                yield reader.line_num, dict(zip(COLUMNS, row, strict=True))
    except csv.Error as error:
        raise ReplayError(f"{path}: line {reader.line_num}: {error}") from error
    if reader.line_num == 0:
        raise ReplayError(f"{path}: is empty")


def _check_header(path: Path, row: list[str]) -> None:
    for number, expected in enumerate(COLUMNS):
        if number >= len(row) or row[number] != expected:
            got = repr(row[number]) if number < len(row) else "nothing"
            raise ReplayError(f"{path}: line 1: column {number + 1} is {got}, not '{expected}'")
    if len(row) > len(COLUMNS):
        raise ReplayError(f"{path}: line 1: column '{row[len(COLUMNS)]}' is unknown")


class _Converter:
    """Rows in order of time to steps."""

    def __init__(self, robot: str) -> None:
        self.robot = robot
        self.steps: list[Step] = []
        self._clock = _Clock()
        self._time = 0.0
        self._announcement: tuple[str, str] | None = None  # by mapped_obs of the newest step
        self._open = False  # the newest step is an observation no placement belongs to yet

    def take(self, row: dict[str, str]) -> None:
        """Convert one row; raises ReplayError naming column and value."""
        t = _time(row["time_s"])
        if t < self._time:
            raise ReplayError(f"column 'time_s': {t} s comes after {self._time} s")
        self._time = t
        source = row["source"]
        if source == "observation":
            self._observe(t, row)
        elif source == "robot":
            self._decide(row["robot_action"])
        elif source == "sensor":
            self._place(t, row)
        elif source not in SOURCES:
            raise ReplayError(f"column 'source': '{source}' is none of {', '.join(SOURCES)}")

    def _observe(self, t: float, row: dict[str, str]) -> None:
        values = {column: _boolean(row, column) for column in BOOLEANS}
        mapped = _mapped(row["mapped_obs"])
        observation = Observation(task_id=1, **values)
        observation.trigger = self._trigger(values)
        self._clock.see(t, observation)
        self._append(t, observation)
        self._announcement = ANNOUNCED.get(mapped) if self.robot == "proactive" else None
        self._open = True

    def _trigger(self, values: dict[str, bool]) -> int:
        if not self.steps:
            return Observation.TRIGGER_START
        before = self.steps[-1].observation
        if values["warning"] and not before.warning:
            return Observation.TRIGGER_WARNING
        if all(getattr(before, column) == value for column, value in values.items()):
            return Observation.TRIGGER_TIMEOUT
        return Observation.TRIGGER_ACTION_CHANGE

    def _decide(self, name: str) -> None:
        if name and name not in ACTION_NAMES:
            known = ", ".join(ACTION_NAMES)
            raise ReplayError(f"column 'robot_action': '{name}' is none of {known}")
        if name and self.steps:
            self.steps[-1].recorded = ACTION_NAMES[name]

    def _place(self, t: float, row: dict[str, str]) -> None:
        status, who = row["subtask_status"], row["who"]
        flag = _placement(status, who)
        if not self._belongs_to_newest(t, status, who):
            self._append(t, self._copy_of_newest())
            self.steps[-1].seen = False
            self._clock.see(t, self.steps[-1].observation)
        observation = self.steps[-1].observation
        setattr(observation, flag, True)
        observation.trigger = Observation.TRIGGER_SUBTASK
        observation.failed_attempts = 0
        self._clock.start_subtask(t)
        self._open = False

    def _belongs_to_newest(self, t: float, status: str, who: str) -> bool:
        """The recorder wrote an observation that a placement triggered before the placement."""
        if not self.steps:
            return False
        newest = self.steps[-1]
        if newest.final:
            return True
        if not self._open:
            return False
        if self._announcement == (status, who):
            return True
        return who == "human" and t - newest.time <= ANNOUNCE_WINDOW

    def _copy_of_newest(self) -> Observation:
        """What is known of the person when a tray reports: as last seen."""
        observation = Observation(task_id=1)
        if self.steps:
            before = self.steps[-1].observation
            for column in BOOLEANS:
                setattr(observation, column, getattr(before, column))
        return observation

    def _append(self, t: float, observation: Observation) -> None:
        observation.header.stamp = genpy.Time.from_sec(t)
        self.steps.append(Step(t, observation))


class _Clock:
    """Clocks and failed attempts of the current subtask, which begins with the last placement."""

    def __init__(self) -> None:
        self.start_subtask(0.0)
        self._warning = False

    def start_subtask(self, t: float) -> None:
        """A placement ended the subtask before."""
        self._started = t
        self._waiting_since = t
        self._failed = 0
        self._attempting = False
        self._attempt_ended: float | None = None

    def see(self, t: float, observation: Observation) -> None:
        """Fill subtask_elapsed, waiting_time and failed_attempts of what is seen at t."""
        if observation.warning:
            self._failed = 0
            self._attempting = False
            self._attempt_ended = None
        elif self._attempt_ended is not None and t - self._attempt_ended >= REPORT_DELAY:
            self._failed += 1
            self._attempt_ended = None
        if observation.warning or self._warning:
            self._waiting_since = t
        self._warning = observation.warning
        if observation.grasp_attempt:
            self._attempting = True
            self._attempt_ended = None
        elif self._attempting:
            self._attempting = False
            self._attempt_ended = t
        observation.subtask_elapsed = round(t - self._started, 6)
        observation.waiting_time = round(t - self._waiting_since, 6)
        observation.failed_attempts = self._failed


def _time(text: str) -> float:
    try:
        t = float(text)
    except ValueError:
        t = math.nan
    if not (math.isfinite(t) and t >= 0):
        raise ReplayError(f"column 'time_s': '{text}' is not a time in seconds")
    return t


def _boolean(row: dict[str, str], column: str) -> bool:
    if row[column] not in ("0", "1"):
        raise ReplayError(f"column '{column}': '{row[column]}' is neither 0 nor 1")
    return row[column] == "1"


def _mapped(text: str) -> str:
    if text and not (text.isascii() and text.isdigit() and int(text) <= 13):
        raise ReplayError(f"column 'mapped_obs': '{text}' is not a whole number from 0 to 13")
    return text


def _placement(status: str, who: str) -> str:
    """Name of the field of Observation that a placement sets."""
    flags = {
        ("success", "human"): "subtask_success",
        ("fail", "human"): "subtask_failure",
        ("success", "robot"): "robot_success",
        ("robot succeeded", "robot"): "robot_success",
        ("fail", "robot"): "robot_failure",
        ("robot failed", "robot"): "robot_failure",
    }
    if who not in ("human", "robot"):
        raise ReplayError(f"column 'who': '{who}' is neither human nor robot")
    if (status, who) not in flags:
        raise ReplayError(f"column 'subtask_status': '{status}' is no result of the {who}")
    return flags[status, who]
