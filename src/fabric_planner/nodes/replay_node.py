#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Feeds a recording to the decision node, one observation after its decision, and reports."""

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import rospkg
import rospy

from fabric_msgs.msg import Decision, Observation
from fabric_msgs.srv import SetModel
from fabric_planner.replay import Recording, ReplayError, Step, read_csv
from fabric_planner.replay_bag import read_bag
from fabric_planner.replay_report import (
    Outcome,
    describe,
    header,
    summarise,
    summary_text,
    write_plot,
)

NAMED_POLICIES = ("proactive", "patient", "eager", "reactive")
POLL = 0.2  # s, how often a wait looks whether the decision node is still there


class ReplayFailed(RuntimeError):
    """The replay cannot go on; the message is a sentence."""


class Replay:
    """One recording through the decision node."""

    def __init__(self, answer_deadline: float) -> None:
        self._deadline = answer_deadline  # s, wall, for the node to appear and for each decision
        self._arrived = threading.Condition()
        self._decision: Decision | None = None
        self._observations = rospy.Publisher("observation", Observation, queue_size=10)
        self._decisions = rospy.Subscriber("decision", Decision, self._on_decision)

    def load(self, model: str) -> object:
        """Let the decision node load the model with a fresh belief; returns its ModelInfo."""
        try:
            rospy.wait_for_service("planner/set_model", timeout=self._deadline)
            answer = rospy.ServiceProxy("planner/set_model", SetModel)(model, False)
        except (rospy.ROSException, rospy.ServiceException) as error:
            raise ReplayFailed(f"the decision node does not load a model: {error}") from error
        if not answer.accepted:
            raise ReplayFailed(f"the decision node refuses {model}: {answer.reason}")
        self._wait(self._connected, "the decision node did not connect", connecting=True)
        return answer.info

    def decide(self, step: Step, names: list) -> Outcome:
        """Publish one observation and wait for the decision on it."""
        sequence = step.observation.sequence
        start = time.monotonic()
        self._observations.publish(step.observation)
        self._wait(lambda: self._answers(sequence), f"no decision on observation {sequence}")
        return Outcome.of(self._decision, names, time.monotonic() - start)

    def _on_decision(self, message: Decision) -> None:
        with self._arrived:
            self._decision = message
            self._arrived.notify_all()

    def _answers(self, sequence: int) -> bool:
        return self._decision is not None and self._decision.observation_sequence == sequence

    def _connected(self) -> bool:
        ends = (self._observations, self._decisions)
        return all(end.get_num_connections() > 0 for end in ends)

    def _wait(self, reached: Callable[[], bool], complaint: str, connecting: bool = False) -> None:
        end = time.monotonic() + self._deadline
        with self._arrived:
            while not reached():
                if rospy.is_shutdown():
                    raise ReplayFailed(f"{complaint}: the replay was stopped")
                if not connecting and not self._connected():
                    raise ReplayFailed(f"{complaint}: the decision node died")
                if time.monotonic() >= end:
                    raise ReplayFailed(f"{complaint} within {self._deadline:g} s")
                self._arrived.wait(POLL)


def read(path: Path) -> Recording:
    """A CSV file or one of our own bags."""
    return read_bag(path) if path.suffix == ".bag" else read_csv(path)


def model_of(policy: str, scenario: str, start_dir: Path) -> str:
    """Model file of a policy given by name or as a file."""
    if policy in NAMED_POLICIES:
        models = Path(rospkg.RosPack().get_path("fabric_planner")) / "models"
        return str(models / f"{scenario}_{policy}.pomdpx")
    path = start_dir / policy
    if not path.is_file():
        allowed = ", ".join(NAMED_POLICIES)
        raise ReplayFailed(f"policy:={policy} is refused: it must be {allowed} or a model file")
    return str(path)


def pace(step: Step, speed: float, start: float) -> None:
    """Wait until the recording's time has come; speed 0 does not wait."""
    if speed > 0:
        remaining = start + step.time / speed - time.monotonic()
        if remaining > 0:
            rospy.sleep(remaining)


def say(text: str) -> None:
    print(text, flush=True)


def run(parameters: dict) -> None:
    """The whole replay; the summary file is written last."""
    start_dir = Path(parameters["start_dir"])
    path = start_dir / parameters["file"]
    recording = read(path)
    out = start_dir / (parameters["out_dir"] or f"runs/replay-{recording.name}")
    out.mkdir(parents=True, exist_ok=True)
    (out / "replay.json").unlink(missing_ok=True)
    replay = Replay(parameters["answer_deadline"])
    model = model_of(parameters["policy"], recording.scenario, start_dir)
    info = replay.load(model)
    say(f"{path}: {len(recording.steps)} observations; model {info.name} ({info.hash[:12]})")
    say(header())
    outcomes = []
    start = time.monotonic()
    for step in recording.steps:
        pace(step, parameters["speed"], start)
        outcomes.append(replay.decide(step, info.observations))
        say(describe(step, outcomes[-1], info.states))
    summary = {"model": info.name, "model_hash": info.hash, **summarise(recording, outcomes)}
    write_plot(out / "replay.png", recording, outcomes, info.states)
    partial = out / "replay.json.part"
    partial.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, out / "replay.json")
    say(summary_text(summary))
    say(f"plot {out / 'replay.png'}\nsummary {out / 'replay.json'}")


def load_parameters() -> dict:
    """Private parameters, all required; raises ReplayFailed naming one that is missing or wrong."""
    values = {}
    for name in ("file", "policy", "speed", "out_dir", "start_dir", "answer_deadline"):
        if not rospy.has_param("~" + name):
            raise ReplayFailed(f"parameter {rospy.resolve_name('~' + name)} is missing")
        values[name] = rospy.get_param("~" + name)
    for name in ("speed", "answer_deadline"):
        number = values[name]
        if not isinstance(number, (int, float)) or not 0 <= number < float("inf"):
            raise ReplayFailed(f"{name}:={number} is refused: it must be a number, 0 or more")
    return values


def main() -> None:
    rospy.init_node("replay")
    try:
        run(load_parameters())
    except (ReplayError, ReplayFailed, OSError) as error:
        sys.exit(f"replay: {error}")
    except rospy.ROSInterruptException:
        sys.exit("replay: stopped")


if __name__ == "__main__":
    main()
