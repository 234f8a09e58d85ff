# SPDX-License-Identifier: BSD-3-Clause
"""Leaving out the ticks in which nothing can happen changes nothing but the time it takes."""

import random

import pytest

import fabric_planner as fp
from fabric_msgs.msg import Decision
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup

FILES = Files()


class Whim:
    """Decides by chance, so that the robot is interrupted in everything it can be at."""

    model = fp.load(FILES.model("reactive", "inspection"))
    model_hash = "whim"

    def __init__(self, seed):
        self._random = random.Random(seed)
        self.seen = []

    def reset(self):
        self.seen.append("reset")

    def decide(self, observation, truth):
        decision = Decision(
            sequence=observation.sequence,
            observation_sequence=observation.sequence,
            task_id=observation.task_id,
            model_hash=self.model_hash,
            action=self._random.choice([Decision.IDLE, *range(5)]),
            belief=[1.0 / len(self.model.states)] * len(self.model.states),
        )
        self.seen += [str(observation), str(decision), truth]
        return decision


class Planned:
    """The best vector of a solved model."""

    solved = {}

    def __init__(self, policy, scenario):
        path = FILES.model(policy, scenario)
        if path not in self.solved:
            self.solved[path] = fp.solve(fp.load(path), work=3e8).lower
        limits = fp.PlannerOptions(1.0, 0.01, 200)
        self._agent = fp.DecisionAgent(str(path), limits, "", "offline", self.solved[path], "idle")
        self.model, self.model_hash = self._agent.model, self._agent.model_hash
        self.seen = []

    def reset(self):
        self._agent.reset()

    def decide(self, observation, truth):
        decision = self._agent.decide(observation).fill(Decision())
        decision.planning_time = 0.0
        self.seen += [str(observation), str(decision), truth]
        return decision


def story(setup, tasks, decider, every_tick):
    """Everything that happened: observations, decisions, truths, rows, type observations."""
    run = HeadlessRun(setup, decider=decider, every_tick=every_tick)
    results = [run.run_task() for _ in range(tasks)]
    return decider.seen, [(result.row, result.codes) for result in results]


@pytest.mark.parametrize("scenario, tasks", [("inspection", 8), ("sorting", 2)])
@pytest.mark.parametrize("seed", range(101, 104))
def test_a_robot_that_does_anything_at_any_time_meets_the_same_events(scenario, tasks, seed):
    setup = RunSetup(scenario, "mixed", "reactive", seed, 0.3)
    every = story(setup, tasks, Whim(seed), True)
    assert len(every[0]) > 20
    assert story(setup, tasks, Whim(seed), False) == every


@pytest.mark.parametrize("scenario, tasks", [("inspection", 12), ("sorting", 2)])
@pytest.mark.parametrize("policy", ["none", "reactive", "proactive"])
@pytest.mark.parametrize("human, noise", [("mixed", None), ("random", 0.0)])
def test_a_robot_that_plans_meets_the_same_events(scenario, tasks, policy, human, noise):
    setup = RunSetup(scenario, human, policy, 107, noise)
    every = story(setup, tasks, Planned(policy, scenario), True)
    assert story(setup, tasks, Planned(policy, scenario), False) == every


def test_most_ticks_are_left_out():
    run = HeadlessRun(RunSetup("inspection", "mixed", "reactive", 108), decider=Whim(1))
    for _ in range(5):
        run.run_task()
    assert 0 < run._cell.steps < 0.4 * run._cell.tick
