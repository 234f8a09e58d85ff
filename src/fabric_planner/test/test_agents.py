# SPDX-License-Identifier: BSD-3-Clause
"""The Python side of decision and motion; the rules themselves are tested in C++."""

import hashlib
import math
import threading
from pathlib import Path
from types import SimpleNamespace

import genpy
import numpy as np
import pytest
from geometry_msgs.msg import Point
from std_msgs.msg import Header

import fabric_planner as fp
from fabric_msgs.msg import (
    Cube,
    CubeArray,
    Decision,
    ExecuteRobotActionResult,
    HandState,
    MoveArmResult,
    Observation,
    RobotActionState,
    SortingRule,
    TaskState,
)

PACKAGE = Path(__file__).resolve().parents[1]
MODELS = PACKAGE / "models"
HELPER = str(PACKAGE / "test" / "models" / "helper.pomdpx")
MOTION = str(PACKAGE / "config" / "motion.yaml")
SAFETY = str(PACKAGE / "config" / "safety.yaml")
LIMITS = str(PACKAGE.parent / "fabric_dobot_driver" / "config" / "magician.yaml")
CELL = str(PACKAGE.parents[1] / "launch" / "config" / "cell.yaml")


def options(max_nodes=200):
    return fp.PlannerOptions(deadline=30.0, gap=0.01, max_nodes=max_nodes)


def observation(sequence, **fields):
    trigger = Observation.TRIGGER_START if sequence == 1 else Observation.TRIGGER_ACTION_CHANGE
    return Observation(sequence=sequence, task_id=1, trigger=trigger, detected=True, **fields)


# -- observation map ------------------------------------------------------------------------------


def test_a_map_takes_a_message_and_gives_an_index():
    symbols = ["calm", "stop"]
    text = "rules: [{when: {warning: true}, symbol: stop}, {symbol: calm}]"
    symbol_map = fp.ObservationMap.parse(text, "tiny", symbols)
    assert symbol_map.symbol(Observation(warning=True)) == 1
    assert symbol_map.symbol(Observation(), previous=1) == 0
    assert symbol_map.observations == symbols


def test_a_bad_map_names_file_and_rule(tmp_path):
    path = tmp_path / "bad.obs.yaml"
    path.write_text("rules: [{when: {idle: true}, symbol: calm}]")
    with pytest.raises(fp.ModelError, match=r"bad\.obs\.yaml: rule 1"):
        fp.ObservationMap.load(str(path), ["calm"])


# -- decision agent -------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.pomdpx")), ids=lambda path: path.stem)
def test_every_shipped_model_decides(path):
    agent = fp.DecisionAgent(str(path), options(20))
    for sequence in range(1, 6):
        decision = agent.decide(observation(sequence, idle=sequence % 2 == 0))
        assert decision.observation_sequence == sequence
        assert decision.lower_bound <= decision.upper_bound + 1e-9
        assert math.isclose(decision.belief.sum(), 1.0, abs_tol=1e-9)
        assert decision.action_name in ("idle", "planning", "point", "grasp", "cancel")


ON_CALL = [  # what is seen, what the robot does
    ({"idle": True}, "idle"),
    ({"looking_around": True}, "idle"),
    ({"warning": True}, "grasp"),  # a call
    ({"warning": True, "looking_around": True}, "grasp"),  # the hand is still up
    ({"idle": True}, "grasp"),
    ({"grasp_attempt": True, "waiting_time": 7.9}, "grasp"),
    ({"warning": True}, "cancel"),
    ({"warning": True}, "cancel"),
    ({"idle": True}, "idle"),
    ({"warning": True}, "grasp"),
    ({"idle": True, "waiting_time": 7.0}, "grasp"),
    ({"idle": True, "waiting_time": 10.0}, "idle"),  # which lets the grasp come to its end
    ({"warning": True}, "cancel"),
    ({"idle": True}, "idle"),
]


@pytest.mark.parametrize("scenario", ["inspection", "sorting"])
def test_on_call_the_robot_comes_by_the_first_hand_and_goes_by_the_next(scenario):
    agent = fp.DecisionAgent(str(MODELS / f"{scenario}_on_call.pomdpx"), options())
    for sequence, (seen, action) in enumerate(ON_CALL, start=1):
        decision = agent.decide(observation(sequence, **seen))
        assert (sequence, decision.action_name) == (sequence, action)
        assert not decision.belief_recovered


@pytest.mark.parametrize(
    "end", ["subtask_success", "subtask_failure", "robot_success", "robot_failure"]
)
def test_on_call_the_next_cube_is_the_person_s_again(end):
    agent = fp.DecisionAgent(str(MODELS / "sorting_on_call.pomdpx"), options())
    seen = [{"idle": True}, {"warning": True}, {"idle": True}, {end: True}, {"idle": True}]
    told = [agent.decide(observation(n, **fields)).action_name for n, fields in enumerate(seen, 1)]
    assert told == ["idle", "grasp", "grasp", "idle", "idle"]


def test_a_decision_fills_a_message():
    decision = fp.DecisionAgent(HELPER, options()).decide(observation(1, idle=True))
    message = decision.fill(Decision())
    assert message.sequence == message.observation_sequence == 1
    assert message.action == decision.action == Decision.IDLE
    assert np.allclose(message.belief, [0.625, 0.375])
    assert message.model_hash == decision.model_hash
    assert message.runner_up == decision.runner_up
    message._check_types()


def test_choosing_goes_on_as_deciding_does():
    told = [observation(n, idle=n % 3 > 0) for n in range(1, 9)]
    deciding, choosing = (fp.DecisionAgent(HELPER, options()) for _ in range(2))
    assert [choosing.choose(o) for o in told] == [deciding.decide(o).action for o in told]
    assert np.array_equal(choosing.belief, deciding.belief)


def test_anything_with_the_fields_of_an_observation_will_do():
    agent = fp.DecisionAgent(HELPER, options())
    like = {name: getattr(observation(1, idle=True), name) for name in Observation.__slots__}
    assert agent.decide(SimpleNamespace(**like)).observation_index == 1


def test_the_same_observations_give_the_same_decisions():
    def run():
        agent = fp.DecisionAgent(str(MODELS / "sorting_proactive.pomdpx"), options())
        decisions = [agent.decide(observation(n, idle=n % 3 > 0)) for n in range(1, 9)]
        return [(d.action, d.value, d.upper_bound, d.nodes, tuple(d.belief)) for d in decisions]

    assert run() == run()


def test_the_hash_is_of_model_and_map():
    agent = fp.DecisionAgent(HELPER, options())
    data = Path(HELPER).read_bytes() + Path(HELPER).with_suffix(".obs.yaml").read_bytes()
    assert agent.model_hash == hashlib.sha256(data).hexdigest()
    assert agent.model_name == "helper"


def test_the_belief_goes_over_to_another_model_by_state_name():
    agent = fp.DecisionAgent(str(MODELS / "inspection_proactive.pomdpx"), options())
    for sequence in range(1, 5):
        agent.decide(observation(sequence, idle=True))
    before = dict(zip(agent.model.states, agent.belief, strict=True))
    agent.set_model(str(MODELS / "inspection_eager.pomdpx"), True)
    after = dict(zip(agent.model.states, agent.belief, strict=True))
    assert after == pytest.approx(before)


def test_a_refused_model_leaves_the_present_one():
    agent = fp.DecisionAgent(HELPER, options())
    with pytest.raises(fp.ModelError, match="nowhere"):
        agent.set_model("/nowhere.pomdpx", True)
    assert agent.model_name == "helper"


def test_a_number_that_is_not_finite_is_refused_by_name():
    agent = fp.DecisionAgent(HELPER, options())
    with pytest.raises(fp.ModelError, match="waiting_time is NaN"):
        agent.decide(observation(1, waiting_time=math.nan))


def test_other_threads_run_while_a_decision_is_made():
    agent = fp.DecisionAgent(
        str(MODELS / "sorting_proactive.pomdpx"), fp.PlannerOptions(30.0, 0.0, 1500)
    )
    done = threading.Event()
    decision = threading.Thread(
        target=lambda: (agent.decide(observation(1, idle=True)), done.set())
    )
    decision.start()
    turns = 0
    while not done.is_set():
        turns += 1
        done.wait(0.001)
    decision.join()
    assert turns > 1


# -- motion agent ---------------------------------------------------------------------------------


def task(task_id=1, status=TaskState.RUNNING):
    rules = [SortingRule(colour=Cube.COLOUR_RED, label="red")]
    return TaskState(task_id=task_id, status=status, scenario="sorting", rules=rules)


def cubes(where=Cube.WHERE_PICK_POINT):
    return CubeArray(cubes=[Cube(colour=Cube.COLOUR_RED, where=where, confidence=0.9)])


def finish(agent, commands):
    """Carry out every move; a lifted cube is seen at the cup. Return all commands."""
    log = list(commands)
    suction = False
    while agent.outstanding is not None:
        suction = suction or any(c.kind == fp.CommandKind.SUCTION_ON for c in commands)
        if suction:
            log += agent.on_conveyor(False) + agent.on_cubes(cubes(Cube.WHERE_ROBOT))
        commands = agent.on_arm_result(agent.outstanding, MoveArmResult.REACHED)
        log += commands
    return log


def ready_agent():
    agent = fp.MotionAgent(MOTION)
    finish(agent, agent.on_task(task()))
    agent.on_conveyor(True)
    agent.on_cubes(cubes())
    agent.take_ends()
    return agent


def test_a_grasp_goes_from_planning_to_the_tray_and_home():
    agent = ready_agent()
    log = finish(agent, agent.on_decision("grasp", 1))
    kinds = [command.kind.name for command in log]
    assert kinds == ["MOVE"] * 3 + ["SUCTION_ON"] + ["MOVE"] * 5 + ["SUCTION_OFF"] + ["MOVE"] * 4
    moves = [c for c in log if c.kind == fp.CommandKind.MOVE]
    assert (moves[-1].x, moves[-1].y, moves[-1].z) == (0.197, -0.001, 0.035)
    assert [end.outcome for end in agent.take_ends()] == [ExecuteRobotActionResult.DONE]


def test_planning_takes_about_four_seconds_and_a_grasp_fourteen_to_eighteen():
    def seconds(log, start):
        # A trapezoid of speed with 0.8 m/s^2 at both ends.
        total, at = 0.0, start
        for c in (c for c in log if c.kind == fp.CommandKind.MOVE):
            total += math.dist(at, (c.x, c.y, c.z)) / c.speed + c.speed / 0.8 + c.settle
            at = (c.x, c.y, c.z)
        return total

    home = (0.197, -0.001, 0.035)
    agent = ready_agent()
    assert 3.0 < seconds(finish(agent, agent.on_decision("planning", 1)), home) < 5.0
    agent = ready_agent()
    assert 14.0 < seconds(finish(agent, agent.on_decision("grasp", 1)), home) < 18.0
    agent = ready_agent()
    assert 2.0 < seconds(finish(agent, agent.on_decision("point", 1)), home) < 4.0


def test_the_state_fills_a_message():
    agent = ready_agent()
    agent.on_decision(Decision.POINT, 7)
    agent.on_decision(Decision.PLANNING, 8)
    message = agent.state().fill(RobotActionState())
    assert message.current == Decision.POINT
    assert message.queued == Decision.PLANNING
    assert message.pre_empted == RobotActionState.NONE
    assert message.phase == RobotActionState.PHASE_APPROACH
    assert message.decision_sequence == 8
    message._check_types()


def test_a_warning_holds_and_a_stop_latches():
    agent = ready_agent()
    (move,) = agent.on_decision("planning", 1)
    assert [c.kind for c in agent.on_warning()] == [fp.CommandKind.CANCEL]
    assert agent.on_arm_result(move.number, MoveArmResult.PRE_EMPTED) == []
    assert agent.held_by_warning
    assert agent.on_stop("a test") == []
    assert agent.stopped
    assert agent.cause == "a test"
    assert agent.on_decision("idle", 2) == []
    assert agent.on_release() == []
    assert len(agent.on_decision("idle", 3)) == 1


def test_a_gesture_is_played_by_its_name():
    agent = ready_agent()
    assert fp.MotionConfig.load(MOTION).gestures["pointing_2"] == "point"
    log = finish(agent, agent.on_gesture("pointing_2"))
    assert len(log) == 6
    assert agent.state().current == Decision.IDLE
    assert [end.outcome for end in agent.take_ends()] == [ExecuteRobotActionResult.DONE]
    with pytest.raises(fp.ModelError, match="no gesture 'wave'; known: cancel, grasp"):
        agent.on_gesture("wave")


def test_a_cube_lost_on_the_way_is_reported():
    agent = ready_agent()
    commands = agent.on_decision("grasp", 1)
    while not agent.state().holding:
        commands = agent.on_arm_result(agent.outstanding, MoveArmResult.REACHED)
    agent.on_conveyor(False)
    agent.on_cubes(cubes(Cube.WHERE_ROBOT))
    for _ in range(3):
        commands = agent.on_cubes(CubeArray())
    assert fp.CommandKind.SUCTION_OFF in [command.kind for command in commands]
    message = agent.state().fill(RobotActionState())
    assert message.lost
    assert not message.holding
    finish(agent, agent.on_arm_result(agent.outstanding, MoveArmResult.PRE_EMPTED))
    assert agent.take_ends()[-1].outcome == ExecuteRobotActionResult.CUBE_LOST


def hand(x, stamp, visible=True):
    header = Header(stamp=genpy.Time.from_sec(stamp))
    return HandState(header=header, visible=visible, position=Point(x, 0.0, 0.185))


def test_the_distance_of_a_hand_slows_and_stops_the_arm():
    agent = ready_agent()
    monitor = fp.SafetyMonitor(SAFETY, LIMITS)
    arm = fp.ArmPlace.load(CELL)
    (move,) = agent.on_decision("planning", 1)
    levels = []
    for step, x in enumerate((0.60, 0.42, 0.30, 0.60)):
        now = 10.0 + 0.1 * step
        monitor.on_tool(now, 0.20, 0.0, 0.05)
        monitor.on_hand(hand(x, now), arm)
        state = monitor.assess(monitor.newest)
        levels.append(state.level)
        commands = agent.on_separation(state.level, monitor.slow_factor)
        if step == 1:
            assert [c.kind for c in commands] == [fp.CommandKind.CANCEL]
            (slow,) = agent.on_arm_result(move.number, MoveArmResult.PRE_EMPTED)
            assert slow.speed == pytest.approx(monitor.slow_factor * move.speed)
            agent.on_tool(slow.x, slow.y, slow.z)  # there already: it only waits
        else:
            assert commands == []
    R, S = fp.Separation.RUN, fp.Separation.SLOW
    assert levels == [R, S, fp.Separation.STOP, R]


def test_the_arbiter_speaks_names_and_numbers():
    assert fp.arbitrate("idle", "grasp") == fp.Verdict.PRE_EMPT
    assert fp.arbitrate(Decision.GRASP, Decision.IDLE) == fp.Verdict.QUEUE
    assert fp.arbitrate(None, "point") == fp.Verdict.START


@pytest.mark.parametrize("action", ["dance", 5, -1])
def test_unknown_actions_are_refused(action):
    with pytest.raises(fp.ModelError):
        ready_agent().on_decision(action, 1)


def test_bad_places_are_refused_by_name():
    text = Path(MOTION).read_text().replace("x: 0.197", "x: .inf")
    with pytest.raises(fp.ModelError, match="poses: home: x: is infinite"):
        fp.MotionConfig.parse(text, "motion.yaml")
    with pytest.raises(fp.ModelError, match="nowhere"):
        fp.MotionAgent("/nowhere.yaml")


# -- which tray ------------------------------------------------------------------------------------


def tray_of(rules, cube_rules, cube):
    """Which tray a grasp puts the cube into, or the reason of the refusal."""
    state = TaskState(task_id=1, status=TaskState.RUNNING, scenario="sorting", rules=rules)
    state.cube_rules = cube_rules
    agent = fp.MotionAgent(MOTION)
    finish(agent, agent.on_task(state))
    agent.on_conveyor(True)
    agent.on_cubes(CubeArray(cubes=[cube]))
    agent.take_ends()
    log = finish(agent, agent.on_decision("grasp", 1))
    (end,) = agent.take_ends()
    if end.outcome != ExecuteRobotActionResult.DONE:
        return end.reason
    released = [command.kind for command in log].index(fp.CommandKind.SUCTION_OFF)
    slot = log[released - 1]
    return min(TRAYS, key=lambda name: math.dist(TRAYS[name], (slot.x, slot.y)))


def picked(number, colour=Cube.COLOUR_RED):
    return Cube(id=number, colour=colour, where=Cube.WHERE_PICK_POINT, confidence=0.9)


TRAYS = {"red": (0.160, -0.285), "green": (0.070, -0.290), "blue": (-0.030, -0.300)}  # m
SEQUENCE = [SortingRule(label=label) for label in ("green", "blue", "green")]
MIXED = [
    SortingRule(colour=Cube.COLOUR_RED, label="green", occurrence=1),
    SortingRule(colour=Cube.COLOUR_RED, label="blue", occurrence=2),
    SortingRule(colour=Cube.COLOUR_GREEN, label="red"),
]


@pytest.mark.parametrize("kind", [list, bytes])  # as made by hand, and as rospy reads them
@pytest.mark.parametrize(("number", "tray"), [(1, "green"), (2, "blue"), (3, "green"), (4, "blue")])
def test_in_a_sequence_a_cube_goes_where_its_turn_says_whatever_its_colour(kind, number, tray):
    for colour in (Cube.COLOUR_UNKNOWN, Cube.COLOUR_RED, Cube.COLOUR_BLUE):
        assert tray_of(SEQUENCE, kind([0, 1, 2, 1]), picked(number, colour)) == tray


@pytest.mark.parametrize(("number", "tray"), [(1, "green"), (2, "blue")])
def test_of_two_cubes_of_a_colour_each_goes_where_its_own_rule_says(number, tray):
    assert tray_of(MIXED, [0, 1, 2], picked(number)) == tray


def test_a_cube_seen_in_another_colour_than_it_has_goes_where_that_colour_belongs():
    assert tray_of(MIXED, [0, 1, 2], picked(3, Cube.COLOUR_RED)) == "green"
    assert tray_of(MIXED, [0, 1, 2], picked(1, Cube.COLOUR_GREEN)) == "red"


@pytest.mark.parametrize(
    ("rules", "cube_rules", "cube", "said"),
    [
        (SEQUENCE, [0, 1, 2], picked(4), "cube 4 of colour 1"),
        (SEQUENCE, [0, 7, 2], picked(2), "cube 2 of colour 1"),
        (SEQUENCE, [], picked(0), "cube 0 of colour 1"),
        (MIXED, [0, 1, 2], picked(1, Cube.COLOUR_BLUE), "cube 1 of colour 3"),
        (MIXED, [0, 1, 2], picked(1, Cube.COLOUR_UNKNOWN), "cube 1 of colour 0"),
        ([SortingRule(label="attic")], [0], picked(1), "cube 1 of colour 1"),
    ],
)
def test_a_cube_without_a_rule_that_names_a_tray_is_refused(rules, cube_rules, cube, said):
    assert tray_of(rules, cube_rules, cube) == f"no rule names a tray for {said}"
