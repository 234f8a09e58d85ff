# SPDX-License-Identifier: BSD-3-Clause
"""A worker in seconds: order of events, answers to the robot, breaks, reproducibility."""

import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from worker_bench import (
    CANCELLING,
    EXPERT,
    MIDDLING,
    PARAMETERS,
    POINTING,
    RESTING,
    TAKING_OVER,
    Bench,
    bench_where,
    new_worker,
)

from fabric_sim import worker_events as ev
from fabric_sim.character import Character, named_generator
from fabric_sim.truth import ANTICIPATED
from fabric_sim.worker_agenda import NEVER, Agenda
from fabric_sim.worker_events import EventKind, RobotView, WorldView
from fabric_sim.worker_parameters import SCENARIOS, STATES, Span, WorkerParameterError
from fabric_sim.worker_responses import origin_of, refusal_probability

MESSAGES = Path(__file__).resolve().parents[2] / "fabric_msgs" / "msg"
WILLING = MIDDLING.with_dials(collaborativeness=1)
STUBBORN = MIDDLING.with_dials(collaborativeness=0)
BEGINNER = Character(0, 1, 1, 0.5)
TIRED = Character(0.5, 0, 1, 0.5)
DISTRACTED = Character(0.5, 1, 0, 0.5)


def constants(message):
    text = (MESSAGES / f"{message}.msg").read_text()
    return {n: int(v) for n, v in re.findall(r"^uint8 (\w+)=(\d+)", text, re.MULTILINE)}


def test_the_robots_numbers_are_those_of_the_messages():
    decision, robot = constants("Decision"), constants("RobotActionState")
    for name in ("IDLE", "PLANNING", "POINT", "GRASP", "CANCEL"):
        assert getattr(ev, f"ROBOT_{name}") == decision[name]
    assert robot["NONE"] == ev.ROBOT_NONE
    for name in ("REST", "APPROACH", "CONTACT", "CARRY", "RETREAT"):
        assert getattr(ev, f"PHASE_{name}") == robot[f"PHASE_{name}"]


# -- alone --


def test_an_expert_looks_lifts_and_places():
    bench = Bench(EXPERT)
    bench.run(30)
    done = [k for k in bench.kinds() if k is not EventKind.STARTED_ACTION]
    assert done == [EventKind.PICKED_CUBE, EventKind.PLACED_CUBE]
    placed = next(e for e in bench.events if e.kind is EventKind.PLACED_CUBE)
    assert placed.container == "inspected"
    assert placed.correct is True
    assert not bench.worker.holding
    assert bench.worker.activity == "idle"


def test_grasping_takes_as_long_as_observed():
    spans = []
    for seed in range(60):
        bench = Bench(EXPERT, seed)
        bench.run(40)
        lifted = [e for e in bench.events if e.kind is EventKind.PLACED_CUBE][0]
        begun = [e.t for e in bench.events if e.action == "grasp" and e.t < lifted.t][0]
        spans.append(lifted.t - begun)
    assert 4.5 < np.mean(spans) < 6.4
    assert np.std(spans) > 0.3


def test_without_a_cube_the_person_waits_and_starts_when_it_comes():
    bench = Bench(MIDDLING, cube=False)
    assert bench.run(60) == []
    assert bench.worker.state == "task_assigned"
    assert bench.worker.activity == "idle"
    bench.world = WorldView(True, ev.HELD_BY_NOBODY)
    assert bench.step()[0].kind is EventKind.STARTED_ACTION


def test_nobody_acts_without_a_subtask():
    worker = new_worker(MIDDLING)
    worker.start_task(0.0, "inspection", named_generator(1, "w"))
    seen = [worker.step(0.05 * k, TAKING_OVER, WorldView()) for k in range(400)]
    assert not any(seen)


def test_nothing_but_the_tasks_status_ends_a_subtask():
    bench = Bench(EXPERT)
    bench.run(60)
    assert bench.worker.state not in ("success", "failure")
    bench.worker.end_subtask(60.0, success=True, by_person=True)
    assert bench.worker.state == "success"
    assert bench.worker.truth(60.0).anticipated_state == "global_success"


def test_a_package_lost_while_in_hand_is_let_go():
    bench = Bench(EXPERT)
    bench.run_until(lambda w: w.holding)
    bench.worker.end_subtask(bench.t, success=False, by_person=False)
    assert [e.kind for e in bench.step()][0] is EventKind.RELEASED
    assert bench.worker.state == "failure"
    assert bench.run(30) == []


def test_a_failed_attempt_leaves_the_package_where_it_is():
    bench, _ = bench_where(lambda w: w.state == "failed_to_grasp", BEGINNER)
    assert EventKind.PICKED_CUBE not in bench.kinds()
    assert bench.worker.counters.failed == 1
    began = [e.t for e in bench.events if e.action == "grasp"][0]
    assert 3.0 < bench.t - began < 13.0


def test_a_break_is_left_returned_from_and_refreshes():
    bench, _ = bench_where(lambda w: w.away, TIRED)
    worker = bench.worker
    worker.person.history.work = 20.0
    assert worker.state == "recovery"
    assert not worker.detected
    assert worker.truth(bench.t).anticipated_state == "needs_help"
    left = bench.t
    bench.run_until(lambda w: w.detected)
    assert bench.t - left > 8.0
    assert [k for k in bench.kinds() if k in (EventKind.LEFT, EventKind.RETURNED)] == [
        EventKind.LEFT,
        EventKind.RETURNED,
    ]
    assert worker.person.history.work == 20.0 - PARAMETERS.history.rest


def test_a_new_task_finds_the_person_at_the_place_of_work():
    bench, seed = bench_where(lambda w: w.away, TIRED)
    worker = bench.worker
    worker.end_task(bench.t, success=False)
    assert worker.tasks_done == 1
    worker.start_task(bench.t, "inspection", named_generator(seed, "next"))
    assert worker.detected
    assert worker.state == "task_assigned"


def test_work_tires_and_help_tires_less():
    own, helped = new_worker(EXPERT), new_worker(EXPERT)
    for worker, by_person in ((own, True), (helped, False)):
        for number in range(10):
            worker.start_task(float(number), "inspection", named_generator(1, number))
            worker.start_subtask(float(number))
            worker.end_subtask(float(number), True, by_person)
            worker.end_task(float(number), True)
    assert own.tasks_done == helped.tasks_done == 10
    assert own.person.now.stamina < helped.person.now.stamina < 1.0
    assert own.truth(10.0).stamina == own.person.now.stamina
    assert own.truth(10.0).tasks_done == 10


def test_success_and_failure_are_never_left_within_a_task():
    for success in (True, False):
        bench = Bench(MIDDLING, 2)
        bench.run(8.0)
        bench.worker.end_subtask(bench.t, success, by_person=False)
        bench.world = WorldView(True, ev.HELD_BY_NOBODY)  # whatever may be seen from now on
        states = set()
        for robot in (POINTING, TAKING_OVER, CANCELLING, RESTING):
            bench.robot = robot
            bench.run(6.0)
            states.add(bench.worker.state)
        assert states == {"success" if success else "failure"}


def test_a_running_worker_never_comes_to_an_end_by_itself():
    for seed in range(20):
        bench = Bench(BEGINNER, seed)
        for robot in (RESTING, POINTING, TAKING_OVER, RESTING):
            bench.robot = robot
            for _ in range(200):
                bench.step()
                assert bench.worker.state not in ("success", "failure")


# -- the robot takes over --


def interrupted(character, reached, answer, **options):
    """Return a bench whose worker was interrupted at `reached` and came to `answer`."""
    seed = 0
    while seed < 3000:
        bench, seed = bench_where(reached, character, seed + 1, **options)
        bench.robot = TAKING_OVER
        bench.run(4.0)
        if bench.worker.interferences == 1 and bench.worker.state == answer:
            return bench
    raise AssertionError(f"never {answer}")


def is_evaluating(worker):
    return worker.state == "evaluating" and worker.action == "idle"


def test_who_refuses_warns_until_the_robot_cancels():
    bench = interrupted(STUBBORN, is_evaluating, "warns_the_robot")
    worker = bench.worker
    assert worker.activity == "warn"
    assert worker.refusals == 1
    assert worker.truth(bench.t).anticipated_state == "warning_received"
    bench.run(10.0)
    assert worker.state == "warns_the_robot"
    assert 4 <= bench.kinds().count(EventKind.WARNED) <= 10
    bench.robot = CANCELLING
    bench.run_until(lambda w: w.state == "robot_receives_the_warning", 4.0)
    assert worker.activity == "idle"
    assert worker.truth(bench.t).anticipated_state == "does_not_need_help"
    bench.robot = RESTING
    bench.run_until(lambda w: w.state in ("evaluating", "tired"), 20.0)


def test_warning_ends_when_the_cube_is_gone():
    bench = interrupted(STUBBORN, is_evaluating, "warns_the_robot")
    annoyed = bench.worker.person.history.unwanted
    bench.worker.end_subtask(bench.t, success=True, by_person=False)
    assert bench.worker.state == "success"
    assert bench.worker.activity == "idle"
    assert bench.worker.person.history.unwanted > annoyed
    assert EventKind.WARNED not in [e.kind for e in bench.run(10.0)]


def test_who_accepts_watches_until_the_robot_has_finished():
    bench = interrupted(WILLING, is_evaluating, "robot_interfered")
    worker = bench.worker
    assert worker.activity == "idle"
    assert worker.truth(bench.t).anticipated_state == "needs_help"
    assert bench.run(15.0) == []
    worker.person.history.unwanted = 2.0
    worker.end_subtask(bench.t, success=True, by_person=False)
    assert worker.state == "success"
    assert worker.person.history.unwanted == 2.0 - PARAMETERS.history.restored


def test_help_that_is_broken_off_is_followed_by_work():
    bench = interrupted(WILLING, is_evaluating, "robot_interfered")
    bench.robot = RESTING
    bench.run_until(lambda w: w.state == "evaluating", 5.0)
    assert EventKind.STARTED_ACTION in bench.kinds()


def test_interference_lowers_the_collaborativeness_of_the_moment():
    bench = interrupted(MIDDLING, is_evaluating, "warns_the_robot")
    truth = bench.worker.truth(bench.t)
    assert truth.collaborativeness < MIDDLING.collaborativeness
    assert truth.interferences == 1


def test_the_robot_is_noticed_after_a_reaction_time_only():
    bench, _ = bench_where(is_evaluating, MIDDLING)
    bench.robot = TAKING_OVER
    bench.step()
    assert bench.worker.interferences == 0
    bench.run(2.0)
    assert bench.worker.interferences == 1


def test_a_robot_that_backs_off_at_once_does_not_interfere():
    bench, _ = bench_where(is_evaluating, MIDDLING)
    bench.robot = TAKING_OVER
    bench.run(0.2)
    bench.robot = RESTING
    bench.run(3.0)
    assert bench.worker.interferences == 0


def test_whoever_is_away_does_not_notice_the_robot():
    bench, _ = bench_where(lambda w: w.away, TIRED)
    bench.robot = TAKING_OVER
    bench.run(3.0)
    assert bench.worker.interferences == 0
    assert bench.worker.state == "recovery"


def test_who_carries_the_package_goes_on_and_is_a_little_annoyed():
    bench = Bench(EXPERT)
    bench.run_until(lambda w: w.holding)
    bench.robot = TAKING_OVER
    bench.run(10.0)
    assert EventKind.PLACED_CUBE in bench.kinds()
    assert bench.worker.interferences == 0
    assert bench.worker.person.history.unwanted == PARAMETERS.history.near_miss


# -- where the person was interrupted --


def test_origins_are_states_or_what_the_hands_do():
    assert origin_of("evaluating", "idle", 2) == "evaluating"
    assert origin_of("evaluating", "grasp", 0) == "grasping"
    assert origin_of("evaluating", "grasp", 1) == "trying_again"
    assert origin_of("failed_to_grasp", "grasp", 1) == "trying_again"
    assert origin_of("tired", "idle", 1) == "tired"
    assert origin_of("evaluating", "look_around", 0) == "no_attention"


def refusal(origin, character=MIDDLING, distracted_for=0.0):
    return new_worker(character).person.refusal(origin, distracted_for, "inspection")


def test_acceptance_depends_on_where_the_person_was_interrupted():
    for character in (WILLING, MIDDLING, STUBBORN):
        assert refusal("tired", character) < refusal("failed_to_grasp", character)
        assert refusal("failed_to_grasp", character) < refusal("evaluating", character)
        assert refusal("evaluating", character) < refusal("grasping", character)
        assert refusal("failed_to_grasp", character) < refusal("trying_again", character)
        assert refusal("trying_again", character) < refusal("grasping", character)
    assert refusal("tired") < 0.1
    assert refusal("failed_to_grasp") < 0.3
    assert refusal("evaluating") > 0.5
    assert refusal("grasping") > 0.7


def test_acceptance_is_scaled_by_collaborativeness():
    for origin in PARAMETERS.responses.refusal_shift:
        assert refusal(origin, WILLING) < refusal(origin, MIDDLING) < refusal(origin, STUBBORN)


def test_the_distracted_accept_in_proportion_to_the_time_of_the_distraction():
    welcome = PARAMETERS.responses.distraction_time
    values = [refusal("no_attention", distracted_for=welcome * share / 4) for share in range(5)]
    assert np.all(np.diff(values) < 0.0)
    assert values[0] > 0.5
    assert values[-1] < 0.15
    assert refusal("no_attention", distracted_for=10 * welcome) == values[-1]


def test_refusal_stays_a_probability_at_the_edges():
    for general, scenario in product((0.0, 1.0), SCENARIOS):
        value = refusal_probability(general, "grasping", 0.0, scenario, PARAMETERS.responses)
        assert 0.0 < value < 1.0


@pytest.mark.parametrize(
    ("character", "reached", "least", "most"),
    [
        (TIRED, lambda w: w.state == "tired" and w.action == "idle", 0.7, 1.0),
        (MIDDLING, is_evaluating, 0.1, 0.6),
        (MIDDLING, lambda w: w.action == "grasp" and not w.holding, 0.05, 0.5),
    ],
)
def test_workers_answer_as_their_origin_says(character, reached, least, most):
    answers, seed = [], 0
    while len(answers) < 60:
        bench, seed = bench_where(reached, character, seed + 1)
        bench.robot = TAKING_OVER
        bench.run(1.0)
        if bench.worker.interferences:
            answers.append(bench.worker.refusals == 0)
    assert least <= np.mean(answers) <= most


# -- pointing, planning --


def test_pointing_brings_most_of_the_distracted_back():
    back, seed = [], 0
    for _ in range(40):
        bench, seed = bench_where(lambda w: w.action == "look_around", DISTRACTED, seed + 1)
        bench.robot = POINTING
        states = []
        for _ in range(60):
            bench.step()
            states.append(bench.worker.state)
        back.append("evaluating" in states)
    assert np.mean(back) > 0.6


def test_pointing_repeatedly_at_somebody_who_works_annoys():
    bench, _ = bench_where(is_evaluating, BEGINNER)
    for _ in range(4):
        bench.robot = POINTING
        bench.run(1.6)
        bench.robot = RESTING
        bench.run(0.5)
    assert 0.0 < bench.worker.person.history.unwanted < 1.0


def test_a_planning_robot_is_harmless_mostly():
    warned = 0
    for seed in range(200):
        bench = Bench(STUBBORN, seed)
        bench.run_until(lambda w: w.state != "task_assigned")
        bench.robot = RobotView(ev.ROBOT_PLANNING, ev.PHASE_APPROACH)
        bench.run(2.0)
        warned += EventKind.WARNED in bench.kinds()
        assert bench.worker.interferences == 0
    assert 0 < warned < 30


# -- sorting --


def test_sorting_needs_rules_and_known_scenarios():
    worker = new_worker()
    with pytest.raises(WorkerParameterError, match="rules"):
        worker.start_task(0.0, "sorting", named_generator(1, "w"))
    with pytest.raises(WorkerParameterError, match=r"'packing'.*inspection, sorting"):
        worker.start_task(0.0, "packing", named_generator(1, "w"))


def test_a_wrong_tray_is_a_failed_attempt_and_the_next_cube_starts_anew():
    bench = Bench(Character(0, 1, 0, 1), 1, "sorting")
    for seed in range(100):
        bench = Bench(Character(0, 1, 0, 1), seed, "sorting")
        bench.run_until(lambda w, b=bench: EventKind.PLACED_CUBE in b.kinds())
        if not bench.events[-1].correct:
            break
    worker = bench.worker
    worker.end_subtask(bench.t, success=False, by_person=True)
    bench.run_until(lambda w: w.action == "idle", 5.0)  # the hand returns
    assert worker.state == "failed_to_grasp"
    assert worker.truth(bench.t).anticipated_state == "may_not_be_capable"
    worker.start_subtask(bench.t, 2)
    assert worker.state == "task_assigned"
    assert worker.counters.failed == 0
    bench.world = WorldView(True, ev.HELD_BY_NOBODY)
    bench.run_until(lambda w: w.action == "grasp" and w.holding)


def test_the_hand_returns_from_the_tray_before_the_next_cube_is_taken():
    bench = Bench(EXPERT, 3, "sorting")
    bench.run_until(lambda w: EventKind.PLACED_CUBE in bench.kinds())
    bench.worker.end_subtask(bench.t, True, by_person=True)
    bench.worker.start_subtask(bench.t, 2)
    bench.world = WorldView(True, ev.HELD_BY_NOBODY)
    placed = bench.t
    later = bench.run(3.0)
    assert later[0].t - placed >= 0.7
    assert bench.worker.truth(bench.t).anticipated_state == "human_doing_ok"


# -- reproducibility, shape --


def scripted(seed):
    bench = Bench(MIDDLING, seed)
    for view in (RESTING, POINTING, RESTING, TAKING_OVER, CANCELLING, RESTING, TAKING_OVER):
        bench.robot = view
        bench.run(6.0)
    return bench.events


def test_the_same_seed_gives_the_same_events_and_another_seed_others():
    assert scripted(5) == scripted(5)
    assert scripted(5) != scripted(6)


def test_a_task_replays_without_the_random_numbers_of_the_tasks_before():
    def second_task(first_steps):
        bench = Bench(MIDDLING, 4)
        bench.run(first_steps)
        bench.worker.end_task(100.0, True)
        bench.worker.person.history.work = 0.0
        bench.worker.start_task(200.0, "inspection", named_generator(9, "worker"))
        bench.worker.start_subtask(200.0)
        events = []
        for k in range(200):
            events += bench.worker.step(200.0 + 0.05 * k, RESTING, WorldView())
        return [e for e in events if e.t >= 200.0 and e.kind is EventKind.STARTED_ACTION][1:]

    assert second_task(1.0) == second_task(3.0)


def test_global_random_state_is_left_alone():
    before = np.random.get_state()[1].copy()
    scripted(7)
    assert (np.random.get_state()[1] == before).all()


def test_skipping_to_the_next_wakeup_changes_nothing():
    every, jumping = Bench(EXPERT, 2), Bench(EXPERT, 2)
    every.run(40)
    while jumping.tick < 800:
        wakeup = jumping.worker.next_wakeup
        if wakeup != NEVER and not jumping.worker._events:
            jumping.tick = max(jumping.tick, int(np.ceil(wakeup / 0.05 - 1e-9)))
        jumping.step()
    assert jumping.events == every.events


def test_every_moment_has_a_truth_in_known_words():
    for seed in range(10):
        for character in (BEGINNER, TIRED, DISTRACTED, STUBBORN):
            bench = Bench(character, seed)
            for _ in range(600):
                bench.step()
                truth = bench.worker.truth(bench.t)
                assert truth.state in STATES
                assert truth.anticipated_state in ANTICIPATED
                assert truth.action == bench.worker.activity


def test_durations_have_their_mean_and_stay_within_their_bounds():
    span = Span(2.0, 0.3, 1.0, 4.0)
    rng = named_generator(1, "span")
    values = [span.draw(rng) for _ in range(4000)]
    assert 1.0 <= min(values) <= max(values) <= 4.0
    assert np.mean(values) == pytest.approx(2.0, abs=0.05)
    assert np.std(values) == pytest.approx(0.6, abs=0.08)


def test_an_agenda_runs_in_order_and_notices_come_first():
    log = []
    agenda = Agenda()
    agenda.add(1.0, lambda t: log.append("a"))
    agenda.add(2.0, lambda t: log.append("b"))
    agenda.notice(1.0, lambda t: log.append("!"))
    agenda.run(0.99)
    assert log == []
    agenda.run(1.0)
    assert log == ["!", "a"]
    assert agenda.until == 2.0
    agenda.clear()
    assert agenda.until == NEVER
    assert not agenda
