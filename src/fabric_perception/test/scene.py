# SPDX-License-Identifier: BSD-3-Clause
"""Short words for the tests: percepts and events of a task."""

from fabric_msgs.msg import HeadState, HumanActivity, Observation, TaskEvent, TaskState
from fabric_perception.observation_agent import ObservationAgent
from fabric_perception.parameters import ObservationParameters

IDLE, GRASP, WARN, OTHER = range(4)
STEP = 0.1  # s, one percept


def activity(
    gesture: int, probability: float = 0.9, detected: bool = True, age: float = 0.0
) -> HumanActivity:
    rest = (1.0 - probability) / 3.0
    posterior = [probability if index == gesture else rest for index in range(4)]
    return HumanActivity(posterior=posterior, detected=detected, evidence_age=age)


def head(looking_around: bool = False, visible: bool = True) -> HeadState:
    return HeadState(looking_around=looking_around, visible=visible)


def event(kind: int, by: int = TaskEvent.BY_NOBODY, task_id: int = 1) -> TaskEvent:
    return TaskEvent(kind=kind, by=by, task_id=task_id)


class Scene:
    """A task in which time moves by one percept a step."""

    def __init__(
        self,
        parameters: ObservationParameters | None = None,
        subtasks: int = 3,
        cube: bool = True,
    ) -> None:
        self.agent = ObservationAgent(parameters)
        self.t = 0.0
        self.subtasks = subtasks
        self.seen: list[Observation] = []
        self.begin(1, cube)

    def begin(self, task_id: int, cube: bool = True) -> None:
        """Start a task; with `cube` its first cube is there at once."""
        self.task_id = task_id
        state = TaskState(task_id=task_id, subtasks_total=self.subtasks)
        self.agent.start_task(self.t, state)
        self.event(TaskEvent.TASK_STARTED)
        if cube:
            self.event(TaskEvent.SUBTASK_STARTED)

    def event(
        self, kind: int, by: int = TaskEvent.BY_NOBODY, ahead: float = 0.0
    ) -> list[Observation]:
        """A task event; it is so many s ahead of the percepts."""
        made = self.agent.on_task_event(self.t + ahead, event(kind, by, self.task_id))
        self.seen += made
        return made

    def percepts(self, gesture: int, count: int = 1, **kwargs) -> list[Observation]:
        """`count` percepts of a gesture; keywords: looking, visible, detected, probability, age."""
        looking, visible = kwargs.pop("looking", False), kwargs.pop("visible", True)
        made: list[Observation] = []
        for _ in range(count):
            self.t = round(self.t + STEP, 6)
            percept = activity(gesture, **kwargs)
            made += self.agent.on_percepts(self.t, percept, head(looking, visible))
        self.seen += made
        return made
