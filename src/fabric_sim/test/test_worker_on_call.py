# SPDX-License-Identifier: BSD-3-Clause
"""People beside a robot on call: who needs help and wants it raises a hand."""

import re

import pytest
from worker_bench import (
    PARAMETERS,
    RESTING,
    RULES,
    TAKING_OVER,
    Bench,
)

from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.character import Character, named_generator
from fabric_sim.manual_worker import ManualWorker
from fabric_sim.worker_events import EventKind, WorldView

FORGETFUL = Character(0.2, 1.0, 1.0, 1.0)  # a collaborative one
NOVICE = "beginner_rested_attentive_collaborative"
EVENT = re.compile(r"(\w+)(?: by=(\w+))?")


def on_call(character, seed=1, scenario="sorting"):
    bench = Bench(character, seed, scenario=scenario)
    rng = named_generator(seed, "worker")
    bench.worker.start_task(0.0, scenario, rng, RULES, 1.0, True)
    bench.worker.start_subtask(0.0, 1)
    return bench


def callers(character, scenario="sorting"):
    """Seeds whose person calls within half a minute."""
    found = []
    for seed in range(1, 41):
        bench = on_call(character, seed, scenario)
        bench.run(30.0)
        if EventKind.CALLED in bench.kinds():
            found.append(seed)
    return found


def test_who_does_not_remember_calls_and_who_knows_or_refuses_help_does_not():
    assert len(callers(FORGETFUL)) > 30
    assert len(callers(Character(1.0, 1.0, 1.0, 1.0))) < 20
    assert len(callers(Character(0.2, 1.0, 1.0, 0.0))) < len(callers(FORGETFUL)) / 2


def test_nobody_calls_a_robot_that_is_not_on_call():
    for seed in range(1, 21):
        bench = Bench(FORGETFUL, seed, scenario="sorting")
        bench.run(30.0)
        assert EventKind.CALLED not in bench.kinds()


def called():
    seed = callers(FORGETFUL)[0]
    bench = on_call(FORGETFUL, seed)
    bench.run_until(lambda worker: worker.action == "warn")
    return bench


def test_a_call_looks_like_a_warning_and_is_none():
    bench = called()
    assert bench.worker.activity == "warn"
    assert bench.worker.state != "warns_the_robot"
    assert EventKind.WARNED not in bench.kinds()
    assert bench.worker.refusals == 0


def test_who_has_called_lets_the_robot_work():
    for seed in callers(FORGETFUL)[:10]:
        bench = on_call(FORGETFUL, seed)
        bench.run_until(lambda worker: worker.action == "warn")
        bench.robot = TAKING_OVER
        bench.run(10.0)
        assert bench.worker.state == "robot_interfered"
        assert EventKind.WARNED not in bench.kinds()
        bench.worker.end_subtask(bench.t, success=True, by_person=False)
        assert bench.worker.refusals == 0


def test_a_robot_that_does_not_come_is_called_again_or_done_without():
    bench = called()
    bench.robot = RESTING
    before = len(bench.events)
    bench.run(60.0)
    later = {event.kind for event in bench.events[before:]}
    assert later & {EventKind.CALLED, EventKind.PICKED_CUBE}


def test_the_keys_call_a_robot_at_rest_and_warn_one_that_comes():
    worker = ManualWorker(named_generator(101, "worker"), PARAMETERS)
    worker.start_task(0.0, "sorting", named_generator(101, "worker", 1), RULES, 1.0, True)
    worker.command("begin")
    worker.start_subtask(0.0, 1)
    kinds = []
    for number, robot in enumerate([RESTING] * 200 + [TAKING_OVER] * 200):
        if number in (10, 300):
            assert worker.command("warn") == (True, "")
        kinds += [e.kind for e in worker.step(0.05 * number, robot, WorldView())]
    assert [k for k in kinds if k in (EventKind.CALLED, EventKind.WARNED)][0] == EventKind.CALLED
    assert kinds.count(EventKind.CALLED) == 1
    assert EventKind.WARNED in kinds


@pytest.mark.parametrize("scenario", ["inspection", "sorting"])
def test_in_the_loop_the_robot_touches_only_cubes_it_was_called_for(scenario):
    run = HeadlessRun(RunSetup(scenario, NOVICE, "on_call", 101, noise=0.0))
    helped = 0
    for _ in range(6):
        row = run.run_task().row
        is_called = False
        for line in run.event_log():
            what, by = EVENT.match(line[6]).groups() if line[4] == "event" else ("", "")
            is_called |= what == "call"
            if what in ("subtask_succeeded", "subtask_failed"):
                assert is_called or by != "robot"
                helped += by == "robot"
                is_called = False
        assert row["policy"] == row["model"] == "on_call"
        assert row["warnings"] == 0
    assert helped > 0


def test_help_on_call_makes_a_task_of_a_novice_better():
    succeeded = {}
    for policy in ("none", "on_call"):
        run = HeadlessRun(RunSetup("sorting", NOVICE, policy, 102))
        rows = [run.run_task().row for _ in range(10)]
        succeeded[policy] = sum(r["human_succeeded"] + r["robot_succeeded"] for r in rows)
    assert succeeded["on_call"] > succeeded["none"] + 20
