# SPDX-License-Identifier: BSD-3-Clause
"""The rules of a task as the cell knows them: where every cube belongs."""

from typing import NamedTuple

from fabric_msgs.msg import TaskState


class CubeRules(NamedTuple):
    """items: of each cube in the order of arrival the item to remember; labels: of each item."""

    items: list[int]
    labels: list[str]

    @classmethod
    def of(cls, task: TaskState) -> "CubeRules":
        """Read them from a task. Raises ValueError when a cube falls under no rule."""
        items = list(task.cube_rules)
        if len(items) != len(task.cube_colours) or any(i >= len(task.rules) for i in items):
            raise ValueError(
                f"task {task.task_id}: {len(task.cube_colours)} cubes fall under {items} "
                f"of {len(task.rules)} rules"
            )
        return cls(items, [rule.label for rule in task.rules])

    @property
    def by_item(self) -> dict[int, str]:
        """Labels by item."""
        return dict(enumerate(self.labels))

    def label(self, cube_id: int) -> str:
        """Return the label of the trays that a cube belongs in; ids count from 1."""
        return self.labels[self.items[cube_id - 1]]
