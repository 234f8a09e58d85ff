# SPDX-License-Identifier: BSD-3-Clause
"""Short words for the tests: a task manager with its belt and containers."""

from dataclasses import replace

from fabric_msgs.msg import Container, ContainerArray, ConveyorState, Cube, TaskEvent
from fabric_study.task_manager import Counters, TaskManager
from fabric_study.tasks import TaskDefinition, load_definition

RED, GREEN, BLUE = Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_BLUE
PERSON, ROBOT, BELT = Container.OWNER_PERSON, Container.OWNER_ROBOT, Container.OWNER_BELT


def definition(colours=(RED, GREEN, BLUE), **changes) -> TaskDefinition:
    """The sorting task with a few cubes and round times."""
    values = dict(count=len(colours), order=tuple(colours), success_needs=2)
    values.update(rules_display_time=1.0, t_max=20.0, arrival_limit=8.0, overrun_limit=5.0)
    return replace(load_definition("sorting"), **{**values, **changes})


class Desk:
    """A task in which time moves by 0.1 s a step."""

    def __init__(
        self, task: TaskDefinition, task_id=1, counters: Counters | None = None, policy=""
    ) -> None:
        self.manager = TaskManager(task, task_id, seed=7, counters=counters, policy=policy)
        self.t = 10.0
        self.events: list[TaskEvent] = []
        self.commands: list[tuple[float, bool]] = []
        self.contents: dict[tuple[int, str], list[int]] = {}
        self.manager.begin(self.t)
        self.note([])

    def note(self, events: list[TaskEvent]) -> list[int]:
        self.events += events
        command = self.manager.belt_command
        if command is not None:
            self.commands.append(command)
        return [event.kind for event in events]

    def belt(self, cube=False, seconds=0.1) -> list[int]:
        """Conveyor states for a while; returns the kinds of the events."""
        kinds: list[int] = []
        for _ in range(round(seconds * 10)):
            self.t = round(self.t + 0.1, 6)
            kinds += self.note(
                self.manager.on_conveyor(self.t, ConveyorState(cube_at_pick_point=cube))
            )
        return kinds

    def run(self) -> list[int]:
        """Let the rules be read until the task runs."""
        return self.belt(seconds=1.1)

    def place(self, cube_id: int, owner: int, label: str) -> list[int]:
        """Put a cube into a container and report all containers."""
        self.contents.setdefault((owner, label), []).append(cube_id)
        return self.report()

    def report(self) -> list[int]:
        containers = [
            Container(owner=owner, label=label, cube_ids=ids)
            for (owner, label), ids in self.contents.items()
        ]
        return self.note(self.manager.on_containers(self.t, ContainerArray(containers=containers)))

    def warn(self) -> list[int]:
        return self.note(self.manager.on_warning(self.t))
