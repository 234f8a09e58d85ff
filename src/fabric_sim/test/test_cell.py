# SPDX-License-Identifier: BSD-3-Clause
"""The cell as a whole, with a worker by script."""

import math

import pytest
from cell_helpers import (
    CONFIG,
    ITEMS,
    SRC,
    B,
    G,
    R,
    ScriptedWorker,
    containers,
    ended,
    run,
    start,
    task,
    until,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from fabric_dobot_driver import Goal, ToolPose
from fabric_msgs.msg import (
    Cube,
    HumanActivity,
    MoveArmResult,
    RobotActionState,
    SortingRule,
    TaskState,
)
from fabric_sim.arm import goal_of
from fabric_sim.cell import Cell, CellConfig
from fabric_sim.stock import Place
from fabric_sim.worker_events import HELD_BY_ROBOT, WorldView

PICK = ToolPose(0.281, 0.035, 0.012, 0.0)
ABOVE = PICK._replace(z=0.072)
RED = ToolPose(0.160, -0.285, -0.039, 0.0)
UPSTREAM = ToolPose(0.280, -0.069, 0.016, 0.0)
NOWHERE = ToolPose(0.200, 0.200, 0.050, 0.0)
ORDER = ["truth", "arm", "conveyor", "containers", "warning", "person"]


def waiting_cube(cell: Cell) -> None:
    until(cell, lambda: cell.stock.at_pick_point is not None)


def drive(cell: Cell, number: int, *poses: ToolPose) -> list:
    """Send the arm along the poses; return the results."""
    results = []
    for pose in poses:
        cell.move(number, Goal(pose, 0.3))
        outputs = until(cell, lambda: cell.arm.number is None)
        results += [r for o in outputs for r in o.arm_results]
        number += 1
    return results


def fetch(cell: Cell) -> None:
    """Let the robot lift the waiting cube."""
    drive(cell, 1, ABOVE, PICK)
    cell.set_suction(True)
    drive(cell, 3, ABOVE)
    assert cell.stock.held_by_robot is not None


def test_nothing_runs_without_a_task():
    cell = Cell(CONFIG, ScriptedWorker(), 1)
    assert not cell.running
    cell.on_task(TaskState(task_id=0, status=TaskState.WAITING))
    assert not cell.running


def test_a_task_starts_with_the_rules_and_freezes_when_it_ends():
    worker = ScriptedWorker()
    cell = Cell(CONFIG, worker, 1)
    state = task()
    state.status = TaskState.SHOWING_RULES
    cell.on_task(state)
    assert cell.running
    run(cell, 1.0)
    assert worker.told == [("start_task", "sorting", {0: "red", 1: "green", 2: "blue"}, 1.0)]
    cell.on_task(task())
    run(cell, 0.1)
    assert worker.told[1:] == [("start_subtask", ITEMS[R])]
    cell.on_task(ended(task()))
    assert not cell.running
    assert worker.told[2:] == [("end_task", True)]


def test_time_counts_ticks_and_percepts_come_at_ten_hertz():
    cell, _ = start()
    outputs = run(cell, 10.0)
    assert [o.t for o in outputs] == [round(0.05 * i, 6) for i in range(1, 201)]
    assert [o.truth is not None for o in outputs] == [False, True] * 100
    truths = [o.truth for o in outputs if o.truth]
    assert [m.sequence for m in truths] == list(range(1, 101))
    assert all(m.header.stamp.to_nsec() == 100_000_000 * m.sequence for m in truths)


def test_messages_come_in_the_order_of_the_lockstep():
    cell, worker = start()
    seen = set()
    outputs = run(cell, 0.2)
    worker.action = "warn"
    cell.move(1, Goal(NOWHERE, 0.5))
    for output in outputs + run(cell, 3.0):
        topics = [s.messages[0][0] for s in output.stimuli()]
        ranks = [next(i for i, word in enumerate(ORDER) if word in _group(t)) for t in topics]
        assert ranks == sorted(ranks)
        seen.update(topics)
    assert seen == {
        "truth",
        "arm/move/result",
        "conveyor/state",
        "cell/containers",
        "human/warning",
        "human/activity",
    }


def _group(topic: str) -> str:
    return {"human/activity": "person"}.get(topic, topic)


def test_the_first_containers_are_empty_and_complete():
    cell, _ = start()
    first = next(o.containers for o in run(cell, 1.0) if o.containers)
    assert [c.label for c in first.containers] == [*["red", "green", "blue"] * 2, "uninspected"]
    assert all(list(c.cube_ids) == [] for c in first.containers)


def test_the_person_takes_and_places_and_the_load_cell_reports_once():
    cell, worker = start()
    waiting_cube(cell)
    worker.pick()
    run(cell, 0.05)
    assert cell.stock.held_by_person.id == 1
    worker.place("green")
    outputs = run(cell, 3.0)
    published = [o.containers for o in outputs if o.containers]
    assert len(published) == 1
    assert containers(outputs) == {2: [1]}
    assert ("end_subtask", False, True) in worker.told
    assert worker.told[-1] == ("start_subtask", ITEMS[G])


def test_the_robot_carries_a_cube_into_its_tray():
    cell, worker = start()
    waiting_cube(cell)
    fetch(cell)
    assert worker.views[-1] == WorldView(False, HELD_BY_ROBOT)
    drive(cell, 4, RED._replace(z=0.05), RED)
    cell.set_suction(False)
    outputs = run(cell, 1.0)
    assert containers(outputs) == {4: [1]}
    assert ("end_subtask", True, False) in worker.told


def test_in_inspection_one_robot_tray_takes_the_package():
    cell, worker = start("inspection", colours=(B,))
    waiting_cube(cell)
    fetch(cell)
    drive(cell, 4, ToolPose(0.065, -0.290, 0.05, 0.0))
    cell.set_suction(False)
    assert containers(run(cell, 1.0)) == {2: [1]}
    assert ("end_subtask", True, False) in worker.told


def test_a_cube_put_back_upstream_comes_again():
    cell, worker = start(colours=(R,))
    waiting_cube(cell)
    fetch(cell)
    drive(cell, 4, UPSTREAM)
    cell.set_suction(False)
    run(cell, 0.05)
    assert cell.stock.belt.places[1] == pytest.approx(-0.104, abs=0.003)
    waiting_cube(cell)
    assert [w for w in worker.told if w[0] == "start_subtask"] == [("start_subtask", ITEMS[R])]


def test_a_cube_that_loses_its_turn_makes_room_for_the_next_one():
    cell, worker = start()
    waiting_cube(cell)
    fetch(cell)
    run(cell, 4.0)
    drive(cell, 4, UPSTREAM)
    cell.set_suction(False)
    run(cell, 0.1)
    assert cell.stock.at_pick_point.id == 2
    assert worker.told[-2:] == [("start_subtask", ITEMS[R]), ("start_subtask", ITEMS[G])]


def test_a_cube_dropped_beside_everything_ends_in_the_belt_box():
    cell, worker = start(colours=(R,))
    waiting_cube(cell)
    fetch(cell)
    drive(cell, 4, NOWHERE)
    cell.set_suction(False)
    run(cell, 0.1)
    assert cell.stock.cubes[1].place is Place.FLOOR
    outputs = run(cell, 3.0)
    assert containers(outputs) == {7: [1]}
    assert worker.told[-1] == ("end_subtask", False, False)


def test_ignoring_the_sensor_lets_the_package_fall_into_the_belt_box():
    cell, worker = start("inspection", colours=(B,))
    waiting_cube(cell)
    cell.set_conveyor(0.05, True)
    outputs = run(cell, 4.0)
    assert containers(outputs) == {3: [1]}
    assert worker.told[-1] == ("end_subtask", False, False)


def test_who_takes_first_has_the_cube():
    cell, worker = start(colours=(R,))
    waiting_cube(cell)
    drive(cell, 1, ABOVE, PICK)
    cell.set_suction(True)
    worker.pick()
    run(cell, 0.05)
    assert cell.stock.held_by_robot.id == 1 and cell.stock.held_by_person is None


def test_the_cup_takes_nothing_that_is_not_under_it():
    cell, _ = start(colours=(R,))
    waiting_cube(cell)
    cell.set_suction(True)
    drive(cell, 1, ABOVE, PICK._replace(y=0.055))
    assert cell.stock.held_by_robot is None


def test_a_released_cube_goes_back_to_the_pick_point():
    cell, worker = start(colours=(R,))
    waiting_cube(cell)
    worker.pick()
    run(cell, 0.5)
    worker.release()
    run(cell, 0.1)
    assert cell.stock.at_pick_point.id == 1


def test_goals_and_cancellations_of_one_tick_do_not_depend_on_their_order():
    def told(*orders):
        cell, _ = start()
        cell.move(1, Goal(ABOVE, 0.2))
        run(cell, 0.5)
        for order in orders:
            order(cell)
        return [r for o in run(cell, 10.0) for r in o.arm_results]

    def move(cell):
        cell.move(2, Goal(NOWHERE, 0.2))

    def cancel(cell):
        cell.cancel(1)

    a, b = told(move, cancel), told(cancel, move)
    assert a == b
    assert [(r.number, r.outcome) for r in a] == [
        (1, MoveArmResult.PRE_EMPTED),
        (2, MoveArmResult.REACHED),
    ]


def test_a_goal_cancelled_before_it_starts_never_moves():
    cell, _ = start()
    cell.cancel(5)
    cell.move(5, Goal(ABOVE, 0.2))
    assert [r.outcome for r in cell.step().arm_results] == [MoveArmResult.PRE_EMPTED]
    assert cell.arm.pose == CONFIG.arm.home


def test_a_goal_that_went_through_float32_is_the_same_goal():
    def ticks(settle):
        cell, _ = start()
        cell.move(1, goal_of(CONFIG.arm.home[:3], 0.0, 0.1, settle))
        return len(until(cell, lambda: cell.arm.number is None))

    assert ticks(3.4) == ticks(3.4000000953674316) == 68


def test_bad_goals_come_back_with_a_reason():
    cell, _ = start()
    cell.move(9, Goal(PICK._replace(x=math.nan), 0.2))
    (result,) = cell.step().arm_results
    assert result == (9, MoveArmResult.INVALID, "x is nan, want a finite number")


@pytest.mark.parametrize("speed", [math.nan, -0.01, 0.2])
def test_a_senseless_belt_speed_is_refused(speed):
    cell, _ = start()
    with pytest.raises(ValueError, match="belt speed is"):
        cell.set_conveyor(speed, False)


def test_an_unknown_motion_command_is_refused():
    class Command:
        parts = ("DANCE", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    with pytest.raises(ValueError, match="unknown kind 'DANCE'"):
        start()[0].command(Command())


def test_warnings_are_announced_once_and_before_the_activity():
    cell, worker = start(seed=3)
    run(cell, 1.0)
    worker.action = "warn"
    outputs = [o for o in run(cell, 2.0) if o.activity]
    warned = [i for i, o in enumerate(outputs) if o.warning]
    assert len(warned) == 1
    posteriors = [list(o.activity.posterior) for o in outputs]
    assert posteriors[warned[0]].index(max(posteriors[warned[0]])) == HumanActivity.WARN


def test_the_person_out_of_sight_is_not_detected():
    cell, worker = start()
    run(cell, 1.0)
    worker.detected = False
    last = [o for o in run(cell, 2.0) if o.activity][-1]
    assert not last.activity.detected and not last.head.visible
    assert last.activity.evidence_age > 1.0


def test_the_robot_state_reaches_the_worker():
    cell, worker = start()
    states = []
    worker.step = lambda t, robot, world: states.append(robot) or []
    cell.on_robot_state(RobotActionState(current=3, phase=2))
    run(cell, 0.05)
    assert states == [(3, 2)]


def test_a_new_task_clears_the_cell_and_starts_in_step():
    cell, _ = start()
    waiting_cube(cell)
    fetch(cell)
    cell.set_suction(False)
    cell.step()
    cell.on_task(ended(task()))
    cell.on_task(task("inspection", 2, (R,)))
    assert cell.stock.held_by_robot is None
    outputs = run(cell, 0.2)
    assert [o.containers is not None for o in outputs] == [False, True, False, False]
    assert len([o.containers for o in outputs if o.containers][0].containers) == 3
    run(cell, 5.0)
    assert cell.stock.belt.places == {}  # the belt waits for its command


def test_missing_files_are_named():
    folder = SRC / "fabric_sim" / "config"
    with pytest.raises(ValueError, match="nowhere.yaml"):
        CellConfig.load(
            SRC.parent / "launch" / "config" / "cell.yaml",
            SRC / "fabric_dobot_driver" / "config" / "magician.yaml",
            folder / "nowhere.yaml",
            folder / "sensing.yaml",
        )


WORDS = ["pick", "place", "release", "suck", "let go", "go", "belt", "through", "stop", "warn"]
SPOTS = [ABOVE, PICK, RED, UPSTREAM, NOWHERE, CONFIG.arm.home]


def obey(cell, worker, number, word, choice):
    if word == "pick" and cell.stock.at_pick_point and not cell.stock.held_by_person:
        worker.pick()
    elif word == "place":
        worker.place(["red", "green", "blue"][choice % 3])
    elif word == "release":
        worker.release()
    elif word in ("suck", "let go"):
        cell.set_suction(word == "suck")
    elif word == "go":
        cell.move(number, Goal(SPOTS[choice % len(SPOTS)], 0.5))
    elif word in ("belt", "through"):
        cell.set_conveyor(0.1, word == "through")
    elif word == "stop":
        cell.cancel(number - 1)
    else:
        worker.action = ["idle", "grasp", "warn", "look_around", "walk_away"][choice % 5]


ORDERS = st.lists(st.tuples(st.sampled_from(WORDS), st.integers(0, 29)), max_size=40)


@settings(max_examples=60, deadline=None)
@given(ORDERS)
def test_every_cube_is_in_one_place_and_reported_once(orders):
    colours = (R, G, B, R, G)
    cell, worker = start(colours=colours)
    reported: dict[int, int] = {}
    for number, (word, choice) in enumerate(orders, start=1):
        obey(cell, worker, number, word, choice)
        for _ in range(20):
            output = cell.step()
            check_cubes(cell, output)
            if output.containers is not None:
                reported = check_containers(output.containers, reported)


def check_cubes(cell, output):
    stock = cell.stock
    on_belt = {c.id for c in stock.cubes.values() if c.place is Place.BELT}
    in_feeder = {c.id for c in stock.cubes.values() if c.place is Place.FEEDER}
    assert on_belt == set(stock.belt.places) and in_feeder == set(stock.belt.waiting)
    for place in (Place.PERSON, Place.ROBOT):
        assert sum(c.place is place for c in stock.cubes.values()) <= 1
    if output.cubes is not None:
        hidden = sum(c.place in (Place.FEEDER, Place.FLOOR) for c in stock.cubes.values())
        ids = [c.id for c in output.cubes.cubes]
        assert len(ids) == len(set(ids)) == len(stock.cubes) - hidden
        assert all(
            c.where in range(Cube.WHERE_BELT, Cube.WHERE_CONTAINER + 1) for c in output.cubes.cubes
        )


def check_containers(message, before):
    now = {cube: c.id for c in message.containers for cube in c.cube_ids}
    assert sum(len(c.cube_ids) for c in message.containers) == len(now)
    assert before.items() <= now.items()
    return now


@settings(max_examples=10, deadline=None)
@given(ORDERS, st.integers(0, 2**31))
def test_the_same_seed_gives_the_same_messages(orders, seed):
    def record():
        cell, worker = start(seed=seed)
        outputs = []
        for number, (word, choice) in enumerate(orders, start=1):
            obey(cell, worker, number, word, choice)
            outputs += run(cell, 0.5)
        return outputs

    assert record() == record()


def test_another_seed_gives_other_messages():
    def record(seed):
        cell, worker = start(seed=seed)
        worker.action = "grasp"
        return [o.activity for o in run(cell, 2.0) if o.activity]

    assert record(1) != record(2)


def test_a_cube_belongs_where_its_own_rule_says_whatever_its_colour():
    worker = ScriptedWorker()
    cell = Cell(CONFIG, worker, 1)
    state = task(colours=(R, R, R))
    state.rules = [SortingRule(label="blue"), SortingRule(label="red")]
    state.cube_rules, state.load = bytes([0, 1, 0]), 0.7  # as rospy reads them
    cell.on_task(state)
    cell.set_conveyor(0.05, False)
    assert worker.told[0] == ("start_task", "sorting", {0: "blue", 1: "red"}, 0.7)
    for label in ("blue", "blue"):
        waiting_cube(cell)
        worker.pick()
        run(cell, 1.0)
        worker.place(label)
        run(cell, 1.0)
    ends = [told for told in worker.told if told[0] == "end_subtask"]
    assert ends == [("end_subtask", True, True), ("end_subtask", False, True)]


@pytest.mark.parametrize("cube_rules", [[0, 1], [0, 1, 3], []])
def test_a_task_with_a_cube_that_falls_under_no_rule_is_refused(cube_rules):
    state = task()
    state.cube_rules = cube_rules
    with pytest.raises(ValueError, match="task 1: 3 cubes fall under .* of 3 rules"):
        Cell(CONFIG, ScriptedWorker(), 1).on_task(state)
