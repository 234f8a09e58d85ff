# SPDX-License-Identifier: BSD-3-Clause
"""Simulated tasks written down as a recording of real people would be: rows of trials.COLUMNS."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import fabric_planner as fp
from fabric_msgs.msg import Decision, HumanActivity, Observation, RobotActionState, TaskState
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup
from fabric_sim.character import human_of_task, named_generator
from fabric_sim.experiments.trials import CANCEL, FLAGS, ROBOT_ACTIONS, Trial, gridded, write_rows
from fabric_sim.sensing import Behaviour
from fabric_sim.staff import Staff
from fabric_sim.truth import Truth
from fabric_sim.worker import Worker
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

TIMEOUT = 3.0  # s, after which the same behaviour is recorded again
ROBOTS = ("proactive", "reactive", "curious")
_ACTING = (
    RobotActionState.PHASE_APPROACH,
    RobotActionState.PHASE_CONTACT,
    RobotActionState.PHASE_CARRY,
)
_NAMES = {Decision.PLANNING: 1, Decision.POINT: 2, Decision.GRASP: 3}
_BOUNDS = ("subtask_success", "subtask_failure", "robot_success", "robot_failure")
_SENSOR = {
    "subtask_success": ("success", "human"),
    "subtask_failure": ("fail", "human"),
    "robot_success": ("robot succeeded", "robot"),
    "robot_failure": ("robot failed", "robot"),
}


class CuriousDecider:
    """A robot without a plan that tries everything now and then, so that every trait can show.

    It cancels when warned. Its choices depend on its generator and on warnings only.
    """

    ODDS = {Decision.IDLE: 0.55, Decision.PLANNING: 0.1, Decision.POINT: 0.1, Decision.GRASP: 0.25}
    LEAST = 4.0  # s that it goes on with what it does

    def __init__(self, agent: fp.DecisionAgent, rng: np.random.Generator) -> None:
        """agent: only the names of its model are used."""
        self._agent, self._rng = agent, rng
        self.reset()

    @property
    def model(self) -> Any:
        """The model whose names the meter shows."""
        return self._agent.model

    @property
    def model_hash(self) -> str:
        """Hash of that model."""
        return self._agent.model_hash

    def reset(self) -> None:
        """Forget the last task."""
        self._action, self._until = Decision.IDLE, 0.0

    def set_model(self, path: str, keep_belief: bool) -> None:
        """There is nothing to be set."""

    def decide(self, observation: Observation, truth: Truth) -> Decision:
        """Return what it does next."""
        now = observation.header.stamp.to_sec()
        if observation.warning:
            self._action, self._until = Decision.CANCEL, now
        elif now >= self._until:
            odds = self.ODDS
            self._action = int(self._rng.choice(list(odds), p=list(odds.values())))
            self._until = now + self.LEAST
        size = len(self._agent.model.states)
        return Decision(
            action=self._action, sequence=observation.sequence, task_id=observation.task_id,
            belief=[1.0 / size] * size,
        )  # fmt: skip


@dataclass
class _Log:
    """Rows so far; times in s from the moment the first cube stands at the pick point."""

    rows: list[dict[str, Any]] = field(default_factory=list)
    began: float | None = None
    flags: dict[str, str] = field(default_factory=dict)
    seen: float = 0.0
    robot: str = ROBOT_ACTIONS[0]

    def add(self, t: float, source: str, **cells: Any) -> None:
        if self.began is not None:
            self.rows.append({"time_s": f"{t - self.began:.3f}", "source": source, **cells})


class RecordedRun(HeadlessRun):
    """A headless run that writes down what the camera, the robot and the trays report."""

    def __init__(self, setup: RunSetup, **stand_ins: Any) -> None:
        """stand_ins: `staff`, `decider` of HeadlessRun."""
        super().__init__(setup, **stand_ins)
        self._log = _Log()

    def record_task(self) -> list[dict[str, Any]]:
        """Run the next task and return its rows."""
        self._log = _Log()
        self.run_task()
        return self._log.rows

    def _on_belt(self, moment: Any) -> None:
        running = self._manager.state.status == TaskState.RUNNING
        if self._log.began is None and running and self._cell.stock.at_pick_point is not None:
            self._log.began = moment.t
            self._log.add(moment.t, "manager")
        super()._on_belt(moment)

    def _on_person(self, moment: Any) -> None:
        super()._on_person(moment)
        flags = _flags(moment.percept.behaviour)
        log = self._log
        if flags != log.flags or moment.t - log.seen >= TIMEOUT - 1e-6:
            log.flags, log.seen = flags, moment.t
            log.add(moment.t, "observation", **flags, mapped_obs=_mapped(flags))

    def _decide(self, t: float, observations: list[Observation]) -> None:
        for observation in observations:
            for bound in _BOUNDS:
                if getattr(observation, bound):
                    status, who = _SENSOR[bound]
                    self._log.add(t, "sensor", subtask_status=status, who=who)
        super()._decide(t, observations)

    def _settle(self) -> None:
        super()._settle()
        state = self._motion.state()
        action = _NAMES.get(state.current, 0)
        if state.current == Decision.GRASP and state.phase not in _ACTING:
            action = 0
        text = CANCEL if state.current == Decision.CANCEL else ROBOT_ACTIONS[action]
        if text != self._log.robot:
            self._log.robot = text
            self._log.add(self._cell.now, "robot", robot_action=text)


def _flags(seen: Behaviour) -> dict[str, str]:
    flags = dict.fromkeys(FLAGS, False)
    if seen.present:
        flags["detected"] = True
        flags["looking_around"] = seen.looking_around
        flags["grasp_attempt"] = seen.activity == HumanActivity.GRASP
        flags["warning"] = seen.activity == HumanActivity.WARN
        flags["idle"] = seen.activity == HumanActivity.IDLE
    return {name: str(int(flag)) for name, flag in flags.items()}


def _mapped(flags: dict[str, str]) -> int:
    """Number of the observation among the twelve of the study (0 absent .. 9 attentive, idle)."""
    on = {name for name, flag in flags.items() if flag == "1"}
    if "detected" not in on:
        return 0
    if "warning" in on:
        return 6
    if "grasp_attempt" in on:
        return 3 if "looking_around" in on else 4
    if "idle" in on:
        return 8 if "looking_around" in on else 9
    return 1 if "looking_around" in on else 2


class FreshPeople:
    """A person of the same type who is new in every task, so that no task changes the next."""

    def __init__(self, setup: RunSetup) -> None:
        self._setup = setup
        self._parameters = WorkerParameters.load()
        self._library = ModelLibrary(self._parameters.model)

    def worker(self, task_number: int) -> Worker:
        """The worker of a task."""
        seed = self._setup.seed
        character = human_of_task(self._setup.human, seed, task_number)
        rng = named_generator(seed, "worker", task_number)
        return Worker(character, rng, self._parameters, self._library)


def record(setup: RunSetup, tasks: int, fresh: bool = False) -> list[list[dict[str, Any]]]:
    """Return the rows of each task; policy "curious" is the CuriousDecider.

    fresh: a new person of the type in each task; otherwise one person tires and learns.
    """
    staff = FreshPeople(setup) if fresh else None
    decider = None
    if setup.policy == "curious":
        agent = Files().agent(Files().model("none", setup.scenario))
        decider = CuriousDecider(agent, named_generator(setup.seed, "curious"))
    run = RecordedRun(setup, staff=staff, decider=decider)
    return [run.record_task() for _ in range(tasks)]


def simulated_trials(
    setup: RunSetup, tasks: int, person: str, fresh: bool = False, first: int = 1
) -> list[Trial]:
    """Return the trials of one simulated person beside one robot, numbered from `first`."""
    return [
        gridded(person, number, setup.policy, setup.scenario, _text(rows), waits=False)
        for number, rows in enumerate(record(setup, tasks, fresh), start=first)
        if any(row["source"] == "observation" for row in rows)
    ]


def _text(rows: list[dict[str, Any]]) -> list[dict[str, str]]:
    return [{**dict.fromkeys(FLAGS, ""), **row} for row in rows]


#: The recordings that come with the package: who, under which root seed. None is a known type.
SHIPPED = {
    "simulated01": ("0.85,0.9,0.9,0.3", 121),
    "simulated02": ("0.35,0.7,0.8,0.8", 122),
    "simulated03": ("0.6,0.3,0.6,0.6", 123),
    "simulated04": ("0.7,0.8,0.25,0.15", 124),
}
_SHIFTS = (("proactive", 2), ("reactive", 2))  # robot, tasks; one person, who tires and learns


def write_shipped(folder: Path) -> list[Path]:
    """Record the people of SHIPPED sorting beside two robots; return the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for person, (dials, seed) in SHIPPED.items():
        staff = Staff(dials, seed)
        for robot, tasks in _SHIFTS:
            run = RecordedRun(RunSetup("sorting", dials, robot, seed), staff=staff)
            for _ in range(tasks):
                number = sum(path.name.startswith(person) for path in paths) + 1
                paths.append(folder / f"{person}_task{number}_{robot}.csv")
                write_rows(paths[-1], run.record_task())
    return paths


if __name__ == "__main__":
    for written in write_shipped(Path(sys.argv[1])):
        print(written)
