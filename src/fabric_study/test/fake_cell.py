# SPDX-License-Identifier: BSD-3-Clause
"""A graph that does what a test says: task node, recorder and planner behind a VisitDesk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from study_play import small_study

from fabric_msgs.clock import header_of
from fabric_msgs.msg import (
    Cube,
    Decision,
    Heartbeat,
    ModelInfo,
    PolicyChoice,
    RobotActionState,
    SafetyState,
    SortingRule,
    TaskEvent,
    TaskState,
    TypeBelief,
)
from fabric_study.event_journal import JOURNAL_FILE, EventJournal
from fabric_study.meter import COLUMNS
from fabric_study.results import ResultsWriter
from fabric_study.web.cell import TaskGoal
from fabric_study.web.desk import Refused
from fabric_study.web.news import News
from fabric_study.web.visit_desk import VisitDesk

RED, GREEN, BLUE = Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_BLUE
PERSON, ROBOT, NOBODY = TaskEvent.BY_PERSON, TaskEvent.BY_ROBOT, TaskEvent.BY_NOBODY
COLOURS = [SortingRule(colour=RED, label="green"), SortingRule(colour=GREEN, label="red")]
STROOP = [
    SortingRule(label="blue", word=RED, ink=BLUE, ink_counts=True),
    SortingRule(label="red", word=GREEN, ink=RED, ink_counts=True),
]
CUBES = 3


class FakeCell:
    """One task at a time, step by step."""

    def __init__(self, run_folder: Path) -> None:
        run_folder.mkdir(parents=True)
        self._journal = EventJournal(run_folder / JOURNAL_FILE)
        self._results = ResultsWriter(run_folder / "results.csv")
        self._sequence = 0
        self.desk: VisitDesk | None = None
        self.news = News(["task", "recorder"])
        self.absent: list[str] = []
        self.commands: list[tuple[str, str]] = []
        self.refuse: dict[str, str] = {}  # command: reason
        self.goal: TaskGoal | None = None
        self.goals: list[TaskGoal] = []
        self.cancelled = 0
        self.callable = True
        self.state = TaskState()

    # --- the seam ---

    def missing(self) -> list[str]:
        return list(self.absent)

    def run_task(self, goal: TaskGoal) -> None:
        self.goal = goal
        self.goals.append(goal)

    def cancel_task(self) -> None:
        self.cancelled += 1

    def can_call(self) -> bool:
        return self.callable

    def sections(self) -> dict[str, Any]:
        return self.news.sections(10.0)

    async def command(self, name: str, text: str = "") -> None:
        self.commands.append((name, text))
        if name in self.refuse:
            raise Refused(self.refuse[name])

    # --- what happens in the graph ---

    def show_rules(self, rules: list[SortingRule] = COLOURS) -> None:
        assert self.goal is not None
        self.state = TaskState(
            task_id=self.goal.task_id, definition=self.goal.definition, seed=self.goal.seed,
            rules=rules, subtasks_total=CUBES, status=TaskState.SHOWING_RULES,
        )  # fmt: skip
        self.event(TaskEvent.TASK_STARTED)
        self.tell()

    def start(self) -> None:
        self.tell(status=TaskState.RUNNING)

    def place(self, colour: int, container: str, by: int = PERSON, right: bool = True) -> None:
        if right:
            self.state.succeeded_by_person += 1
        kind = TaskEvent.SUBTASK_SUCCEEDED if right else TaskEvent.SUBTASK_FAILED
        score = 10 if right else -6
        self.event(kind, by=by, cube_colour=colour, container=container, score=score)

    def end(self) -> None:
        self.event(TaskEvent.TASK_SUCCEEDED)
        self.tell(status=TaskState.SUCCEEDED, duration=95.0)

    def abort(self) -> None:
        self.event(TaskEvent.TASK_ABORTED)
        self.tell(status=TaskState.ABORTED)

    def write_row(self) -> None:
        assert self.goal is not None
        row = dict.fromkeys(COLUMNS)
        row.update(task=self.goal.task_id, seed=self.goal.seed, scenario="sorting", human="")
        row.update(policy=self.goal.policy, model="", success=1, warnings=0)
        row.update(duration_s=95.0, task_success_rate=self.state.succeeded_by_person / CUBES)
        self._results.write(row)

    def event(self, kind: int, **fields: Any) -> None:
        assert self.goal is not None and self.desk is not None
        self._sequence += 1
        event = TaskEvent(
            header=header_of(100.0 + self._sequence, ""), sequence=self._sequence,
            task_id=self.goal.task_id, kind=kind, **fields,
        )  # fmt: skip
        self._journal.append(event)
        self.desk.task.on_event()

    def tell(self, **changes: Any) -> None:
        assert self.desk is not None
        for name, value in changes.items():
            setattr(self.state, name, value)
        self.desk.task.on_state(self.state)

    def play(self) -> None:
        """A whole task, from its rules to its row."""
        self.show_rules()
        self.start()
        self.place(RED, "green")
        self.place(GREEN, "green", right=False)
        self.place(BLUE, "", by=NOBODY, right=False)
        self.end()
        self.write_row()
        self.desk.tick()


def fill(news: News) -> None:
    """What the graph says in the middle of a task."""
    states = ["task_assigned_to_human", "may_not_be_capable", "may_be_tired", "may_be_distracted",
              "needs_help", "does_not_need_help", "warning_received"]  # fmt: skip
    belief = [0.12, 0.09, 0.31, 0.04, 0.36, 0.06, 0.02]
    news.on_model(ModelInfo(name="sorting_proactive", hash="h", states=states))
    actions = [Decision.IDLE, Decision.POINT, Decision.IDLE, Decision.PLANNING, Decision.GRASP]
    for number, action in enumerate(actions, start=1):
        news.on_decision(
            Decision(
                sequence=number,
                model_hash="h",
                action=action,
                belief=belief,
                value=4.2 - 0.3 * number,
                runner_up=1,
                runner_up_gap=0.05 * number,
                planning_time=0.21 + 0.01 * number,
                deadline_missed=number == 2,
            )  # fmt: skip
        )
    names = ["balanced_modest", "active_strict", "reserved_calm", "reactive"]
    news.on_choice(
        PolicyChoice(
            policy="balanced_modest",
            candidates=names,
            score=[0.42, 0.3, 0.11, 0.02],
            reason="most is to be gained with it.",
        )  # fmt: skip
    )
    types = [
        "expert_rested_attentive_collaborative",
        "beginner_tired_distracted_collaborative",
        "expert_tired_attentive_noncollaborative",
        "beginner_rested_attentive_collaborative",
    ]
    news.on_types(TypeBelief(types=types, probability=[0.2, 0.55, 0.05, 0.2], entropy=1.12))
    watched = {"watched": ["decision", "task"], "age": [0.05, 0.04], "separation": 0.42}
    news.on_safety(9.9, SafetyState(state=SafetyState.RUN, **watched))
    news.on_robot(RobotActionState(current=Decision.GRASP, phase=RobotActionState.PHASE_APPROACH))
    for name in ("task", "recorder", "decision", "motion", "observation", "abps"):
        news.on_heartbeat(9.9, Heartbeat(node=name))


def small_desk(folder: Path, auto_start: bool = False) -> tuple[VisitDesk, FakeCell]:
    """A desk of the small study with a run of its own; times run by seconds."""
    return desk_of(small_study(folder), auto_start)


def desk_of(study: Any, auto_start: bool = False) -> tuple[VisitDesk, FakeCell]:
    """A desk of a study, in a new run."""
    run_folder = study.new_run()
    cell = FakeCell(run_folder)
    clock = iter(range(1000, 10**9))
    desk = VisitDesk(study, run_folder, cell, lambda: float(next(clock)), auto_start)
    cell.desk = desk
    return desk, cell
