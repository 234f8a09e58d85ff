# SPDX-License-Identifier: BSD-3-Clause
"""What an experiment may put in place of a part of the headless runner."""

import math

import pytest

import fabric_planner as fp
from fabric_msgs.msg import Decision
from fabric_sim.batch_loop import Files, HeadlessRun, RunSetup
from fabric_sim.staff import Staff
from fabric_sim.truth import ANTICIPATED

SETUP = RunSetup(policy="reactive", seed=101)


class Watcher:
    """Always idle; keeps the observations and truths it is shown."""

    model = fp.load(Files().model("reactive", "inspection"))
    model_hash = "watcher"

    def __init__(self):
        self.seen = []
        self.resets = 0

    def reset(self):
        self.resets += 1

    def set_model(self, path, keep_belief):
        raise AssertionError("nobody selects a policy here")

    def decide(self, observation, truth):
        self.seen.append((observation, truth))
        belief = [1.0 / len(self.model.states)] * len(self.model.states)
        return Decision(
            sequence=observation.sequence,
            observation_sequence=observation.sequence,
            task_id=observation.task_id,
            model_hash=self.model_hash,
            action=Decision.IDLE,
            belief=belief,
        )


def test_another_decider_is_asked_on_every_observation_and_told_the_truth():
    watcher = Watcher()
    run = HeadlessRun(SETUP, decider=watcher)
    results = [run.run_task(), run.run_task()]
    assert watcher.resets == 2
    assert len(watcher.seen) == sum(result.row["decisions"] for result in results) > 4
    assert {truth.anticipated_state for _, truth in watcher.seen} <= set(ANTICIPATED)
    assert all(decision.model_hash == "watcher" for decision in results[0].decisions)


class Others:
    """A staff of one, whoever is asked for."""

    def __init__(self):
        self.staff = Staff("beginner_tired_distracted_noncollaborative", 7)
        self.asked = []

    def worker(self, task_number):
        self.asked.append(task_number)
        return self.staff.worker(1)


def test_another_staff_says_who_works():
    others = Others()
    run = HeadlessRun(SETUP, staff=others)
    names = {run.run_task().row["human"] for _ in range(2)}
    assert names == {"beginner_tired_distracted_noncollaborative"}
    assert {1, 2} <= set(others.asked)


def recognised(noise):
    """Observations of five tasks under a probability of confusion."""
    watcher = Watcher()
    run = HeadlessRun(RunSetup("inspection", "mixed", "none", 102, noise), decider=watcher)
    return [run.run_task().row["decisions"] for _ in range(5)], watcher.seen


def test_noise_takes_the_place_of_the_probability_of_confusion():
    shipped = Files().cell().sensing.confusion
    assert recognised(shipped)[1] == recognised(None)[1]
    assert recognised(1.0)[1] != recognised(None)[1]


@pytest.mark.parametrize("noise", [-0.1, 1.5, math.nan, math.inf])
def test_noise_that_is_no_probability_is_refused(noise):
    with pytest.raises(ValueError, match=f"noise is {noise}; it must lie in 0..1"):
        RunSetup(noise=noise)


@pytest.mark.parametrize("scenario, tasks", [("inspection", 6), ("sorting", 2)])
def test_scoring_tasks_tells_what_running_them_tells(scenario, tasks):
    setup = RunSetup(scenario, "mixed", "reactive", 103)
    full, brief = HeadlessRun(setup), HeadlessRun(setup)
    for _ in range(tasks):
        result = full.run_task()
        assert brief.score_task() == (result.row["discounted_reward"], result.codes)


def test_a_decider_of_ones_own_decides_when_tasks_are_scored():
    watcher = Watcher()
    _, codes = HeadlessRun(SETUP, decider=watcher).score_task()
    assert len(watcher.seen) == len(codes) > 0
