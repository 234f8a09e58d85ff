# SPDX-License-Identifier: BSD-3-Clause
"""The cell with a simulated person, who works alone: the robot stands still."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from cell_helpers import CONFIG, B, G, R, run, task

from fabric_msgs.msg import Container, HumanActivity, TaskState
from fabric_sim.cell import Cell
from fabric_sim.character import CharacterError
from fabric_sim.staff import Staff
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters

PARAMETERS = WorkerParameters.load()


def value_iteration(T, R, discount):
    """Q (A, S) of an MDP, T (A, S, S), R (A, S)."""
    q = np.zeros(R.shape)
    for _ in range(500):
        q = R + discount * T @ q.max(axis=0)
    return SimpleNamespace(q=q)


LIBRARY = ModelLibrary(PARAMETERS.model, value_iteration)


def staff(human: str, seed: int) -> Staff:
    return Staff(human, seed, PARAMETERS, LIBRARY)


def work(human: str, scenario: str, colours, seed: int, seconds: float, config=CONFIG):
    """Outputs of a task in which the belt always goes on."""
    cell = Cell(config, staff(human, seed).worker(1), seed)
    cell.on_task(task(scenario, colours=colours))
    cell.set_conveyor(0.05, False)
    return cell, run(cell, seconds)


def contents(outputs) -> dict[tuple[int, str], list[int]]:
    last = [o.containers for o in outputs if o.containers][-1]
    return {(c.owner, c.label): list(c.cube_ids) for c in last.containers if c.cube_ids}


def test_an_expert_inspects_the_package_in_time():
    done = 0
    for seed in range(10):
        _, outputs = work("expert_rested_attentive_collaborative", "inspection", (B,), seed, 52.0)
        done += contents(outputs) == {(Container.OWNER_PERSON, "inspected"): [1]}
    assert done >= 9


def test_a_beginner_needs_longer_than_an_expert():
    def mean_time(human):
        times = []
        for seed in range(12):
            _, outputs = work(human, "inspection", (B,), seed, 60.0)
            lying = [o.t for o in outputs if o.containers and contents([o])]
            times.append(lying[0] if lying else 60.0)
        return np.mean(times)

    expert = mean_time("expert_rested_attentive_collaborative")
    assert mean_time("beginner_tired_distracted_noncollaborative") > 1.3 * expert


def test_an_attentive_expert_sorts_most_cubes_right():
    colours = (R, G, B, R, B, G)
    _, outputs = work("expert_rested_attentive_collaborative", "sorting", colours, 1, 90.0)
    trays = contents(outputs)
    assert sum(len(ids) for ids in trays.values()) == len(colours)
    right = {"red": R, "green": G, "blue": B}
    good = [i for (_, label), ids in trays.items() for i in ids if colours[i - 1] == right[label]]
    assert len(good) >= 5


def test_percepts_follow_the_person():
    exact = replace(CONFIG, sensing=replace(CONFIG.sensing, confusion=0.0))
    human = "expert_rested_attentive_collaborative"
    cell, outputs = work(human, "sorting", (R, G, B), 2, 40.0, exact)
    pairs = [(o.truth.action, list(o.activity.posterior)) for o in outputs if o.truth]
    grasping = [np.argmax(p) == HumanActivity.GRASP for action, p in pairs if action == "grasp"]
    assert np.mean(grasping) > 0.85
    assert cell.worker.tasks_done == 0


def test_the_same_seed_gives_the_same_person():
    _, a = work("beginner_tired_attentive_collaborative", "inspection", (B,), 5, 30.0)
    _, b = work("beginner_tired_attentive_collaborative", "inspection", (B,), 5, 30.0)
    assert a == b


def test_the_same_person_keeps_a_history_and_mixed_ones_change():
    same = staff("expert_rested_attentive_collaborative", 1)
    assert same.worker(1) is same.worker(2)
    mixed = staff("mixed", 1)
    names = [mixed.worker(n).person.character.name for n in range(1, 6)]
    assert len(set(names)) == 5


def test_an_unknown_person_is_refused():
    with pytest.raises(CharacterError, match="unknown human type 'nobody'; allowed"):
        staff("nobody", 1)


def test_a_person_interrupted_by_the_end_drops_what_is_in_the_hand():
    cell, _ = work("expert_rested_attentive_collaborative", "inspection", (B,), 1, 0.5)
    for _ in range(2000):
        cell.step()
        if cell.stock.held_by_person:
            break
    assert cell.stock.held_by_person
    cell.on_task(TaskState(task_id=1, scenario="inspection", status=TaskState.ABORTED))
    cell.on_task(task("inspection", 2, (B,)))
    outputs = run(cell, 3.0)
    assert cell.stock.held_by_person is None
    assert contents(outputs) == {}
