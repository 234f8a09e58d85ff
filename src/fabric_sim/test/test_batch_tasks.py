# SPDX-License-Identifier: BSD-3-Clause
"""The five types of tasks in the headless runner."""

import re

import pytest

from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup

TYPES = ("type_1_colours", "type_2_sequence", "type_3_mixed", "type_4_memory", "type_5_stroop")
NOVICE = "beginner_rested_attentive_collaborative"
LEARNER = "0.6,0.8,0.8,0.5"
PLACED = re.compile(r"subtask_\w+ by=(\w+) cube=(\d+) .*container=(\w+)")


def placements(run: HeadlessRun) -> list[tuple[str, int, str]]:
    """By whom, cube and container of every placement of the last task."""
    found = [PLACED.match(row[-1]) for row in run.event_log() if row[4] == "event"]
    return [(m[1], int(m[2]), m[3]) for m in found if m]


@pytest.mark.parametrize("name", TYPES)
def test_the_robot_puts_cubes_where_their_own_rules_say(name):
    definition = Files().definition(name)
    run = HeadlessRun(RunSetup("sorting", NOVICE, "reactive", 101, noise=0.0, task=name))
    helped = wrong = 0
    for _ in range(3):
        row = run.run_task().row
        indices = definition.cube_rules(int(row["seed"]))
        for by, cube, container in placements(run):
            helped += by == "robot"
            wrong += by == "robot" and container != definition.rules.items[indices[cube - 1]].label
        assert sum(row[key] for key in row if key.endswith(("_succeeded", "_failed"))) == 10
    assert helped > 5
    assert wrong <= (1 if name in ("type_1_colours", "type_3_mixed") else 0)  # colours seen wrong


def test_people_alone_make_more_mistakes_the_heavier_the_load():
    succeeded = []
    for name in ("type_1_colours", "type_4_memory", "type_5_stroop"):
        run = HeadlessRun(RunSetup("sorting", LEARNER, "none", 102, task=name))
        succeeded.append(sum(run.run_task().row["human_succeeded"] for _ in range(20)))
    assert succeeded[0] > succeeded[1] > succeeded[2], succeeded


def test_a_task_of_another_scenario_is_refused():
    with pytest.raises(ValueError, match="task type_4_memory is of scenario sorting, not inspect"):
        HeadlessRun(RunSetup("inspection", task="type_4_memory"))


def test_the_task_named_like_its_scenario_is_the_one_without_a_name():
    logs = []
    for task in ("", "sorting"):
        run = HeadlessRun(RunSetup("sorting", NOVICE, "reactive", 103, task=task))
        run.run_task()
        logs.append(run.event_log())
    assert logs[0] == logs[1]
