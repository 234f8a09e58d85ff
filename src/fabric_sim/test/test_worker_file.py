# SPDX-License-Identifier: BSD-3-Clause
"""Workers from POMDPX files: read by name, run like the built-in ones, refused with a reason."""

from pathlib import Path

import numpy as np
import pytest

import fabric_planner as fp
from fabric_sim.character import Character, CharacterError, named_generator
from fabric_sim.staff import Staff, check_human
from fabric_sim.worker_events import ROBOT_GRASP, EventKind, RobotView, WorldView
from fabric_sim.worker_export import export, main
from fabric_sim.worker_file import (
    ACTION_ALIASES,
    NEUTRAL,
    STATE_ALIASES,
    FileWorker,
    WorkerFile,
    conditioned,
    to_pomdp,
)
from fabric_sim.worker_model import ACTION_INDEX, STATE_INDEX, ModelLibrary
from fabric_sim.worker_parameters import ACTIONS, STATES, WorkerParameters

EXAMPLE = Path(__file__).parents[1] / "models/example_worker.pomdpx"
PARAMETERS = WorkerParameters.load()
EXPERT = Character.parse("expert_rested_attentive_collaborative")
PRESENT, ABSENT = WorldView(True), WorldView(False)


def built_in():
    return ModelLibrary(PARAMETERS.model).build(EXPERT)


def save(path, T=None, R=None, states=STATES, actions=ACTIONS, discount=0.9, observations=None):
    """A worker's file; T (A, S, S) and R (A, S) of an expert unless given."""
    model = built_in()
    T, R = model.T if T is None else T, model.R if R is None else R
    n = len(states)
    names = observations or list(states)
    seen = np.eye(n) if observations is None else np.full((n, len(names)), 1.0 / len(names))
    O = np.stack([seen] * len(actions))  # noqa: E741
    start = np.eye(n)[0]
    made = fp.Pomdp(list(states), list(actions), names, T, O, R, discount, start, "worker")
    fp.save_pomdpx(made, path)
    return path


def alone(worker, seconds=60.0):
    """One inspection without a robot; the events in order."""
    worker.start_task(0.0, "inspection", named_generator(101, "task"))
    worker.start_subtask(0.0)
    events, held = [], False
    for tick in range(int(seconds / 0.05)):
        for event in worker.step(tick * 0.05, RobotView(), ABSENT if held else PRESENT):
            events.append(event)
            held = event.kind is EventKind.PICKED_CUBE or (
                held and event.kind is not EventKind.RELEASED
            )
            if event.kind is EventKind.PLACED_CUBE:
                return events
    return events


def test_what_was_written_is_read_back_whatever_the_order_and_the_spelling(tmp_path):
    model = built_in()
    order_s, order_a = np.random.default_rng(101).permutation(12), [4, 2, 0, 3, 1]
    original = {name: alias for alias, name in (STATE_ALIASES | ACTION_ALIASES).items()}
    path = save(
        tmp_path / "shuffled.pomdpx",
        model.T[np.ix_(order_a, order_s, order_s)],
        model.R[np.ix_(order_a, order_s)],
        [original[STATES[i]] for i in order_s],
        [original[ACTIONS[i]] for i in order_a],
    )
    read = WorkerFile.load(path, PARAMETERS).model(NEUTRAL)
    np.testing.assert_allclose(read.T, model.T, atol=1e-12)
    np.testing.assert_allclose(read.R, model.R, atol=1e-12)


def test_the_policy_is_the_softmax_over_q_of_the_files_own_discount(tmp_path):
    model = built_in()
    for discount in (0.5, 0.95):
        path = save(tmp_path / "worker.pomdpx", discount=discount)
        q = np.asarray(fp.solve_mdp_arrays(model.T, model.R, discount).q)
        policy = WorkerFile.load(path, PARAMETERS).model(NEUTRAL).policy
        s, choices = STATE_INDEX["evaluating"], [ACTION_INDEX[a] for a in ACTIONS if a != "warn"]
        weight = np.exp(q[choices, s] / PARAMETERS.model.temperature)
        np.testing.assert_allclose(policy[s, choices], weight / weight.sum(), rtol=1e-6)


def test_nobody_warns_a_robot_that_is_not_there(tmp_path):
    T = 0.9 * built_in().T + 0.1 / len(STATES)
    read = WorkerFile.load(save(tmp_path / "leaky.pomdpx", T), PARAMETERS).model(NEUTRAL)
    warns, warned = STATE_INDEX["warns_the_robot"], STATE_INDEX["robot_receives_the_warning"]
    assert conditioned(T)[ACTION_INDEX["idle"], STATE_INDEX["evaluating"], warns] > 0.0
    for state in ("task_assigned", "evaluating", "no_attention", "tired", "recovery"):
        assert not read.now[:, STATE_INDEX[state], [warns, warned]].any()
        assert read.policy[STATE_INDEX[state], ACTION_INDEX["warn"]] == 0.0
    np.testing.assert_allclose(read.now.sum(axis=2), 1.0)


def test_somebody_who_gets_to_recovery_leaves_the_place_of_work(tmp_path):
    T = np.array(built_in().T)
    T[:, STATE_INDEX["evaluating"]] = np.eye(12)[STATE_INDEX["recovery"]]
    worker = FileWorker(
        WorkerFile.load(save(tmp_path / "leaver.pomdpx", T), PARAMETERS),
        named_generator(101, "worker"),
        PARAMETERS,
    )
    events = alone(worker)
    assert [e.action for e in events if e.kind is EventKind.LEFT][:1] == ["walk_away"]


def test_the_files_refusal_decides_and_unwanted_help_raises_it(tmp_path):
    T = np.array(built_in().T)
    row = T[ACTION_INDEX["idle"], STATE_INDEX["robot_interfered"]]
    row[:] = 0.0
    row[STATE_INDEX["warns_the_robot"]], row[STATE_INDEX["robot_interfered"]] = 0.3, 0.7
    file = WorkerFile.load(save(tmp_path / "worker.pomdpx", T), PARAMETERS)
    assert file.model(NEUTRAL).refusal == pytest.approx(0.3)
    worker = FileWorker(file, named_generator(101, "worker"), PARAMETERS)
    before = worker.acceptance(0.0)
    worker.person.annoyed(6.0)
    assert worker.acceptance(0.0) < before - 0.02
    row[STATE_INDEX["warns_the_robot"]], row[STATE_INDEX["success"]] = 0.0, 0.3
    willing = WorkerFile.load(save(tmp_path / "willing.pomdpx", T), PARAMETERS)
    assert willing.model(NEUTRAL.with_dials(collaborativeness=0.0)).refusal == 0.0


def test_help_is_accepted_by_where_the_person_was_interrupted():
    accepted = {}
    for state in ("tired", "evaluating"):
        worker = Staff(str(EXAMPLE), seed=101).worker(1)
        worker.state = state
        accepted[state] = worker.acceptance(0.0)
    assert accepted["tired"] > accepted["evaluating"] + 0.1


def test_the_shipped_example_works_and_is_called_by_its_file():
    worker = Staff(str(EXAMPLE), seed=101).worker(1)
    assert worker.truth(0.0).human_type == "example_worker"
    assert worker.truth(0.0).expertise == 0.5
    placed = [alone(worker)[-1].kind is EventKind.PLACED_CUBE for _ in range(20)]
    assert sum(placed) >= 12


def test_the_robot_overrides_a_worker_from_a_file():
    worker = Staff(str(EXAMPLE), seed=101).worker(1)
    worker.start_task(0.0, "inspection", named_generator(101, "task"))
    worker.start_subtask(0.0)
    seen = set()
    for tick in range(100):
        worker.step(tick * 0.05, RobotView(ROBOT_GRASP, 1), PRESENT)
        seen.add(worker.state)
    assert seen & {"robot_interfered", "warns_the_robot"}


def test_one_person_works_in_every_task_and_equal_seeds_do_equal_things():
    staff = Staff(str(EXAMPLE), seed=101)
    assert staff.worker(1) is staff.worker(2)
    again = Staff(str(EXAMPLE), seed=101)
    assert alone(staff.worker(1)) == alone(again.worker(1))


def test_the_shipped_example_is_what_its_command_writes_in_shape(tmp_path):
    path = tmp_path / "fresh.pomdpx"
    assert main(["expert_tired_attentive_collaborative", str(path)]) == 0
    fresh, shipped = (WorkerFile.load(p, PARAMETERS).model(NEUTRAL) for p in (path, EXAMPLE))
    assert fresh.T.shape == shipped.T.shape
    assert main(["nobody", str(path)]) == 2
    with pytest.raises(CharacterError, match="nobody"):
        export("nobody", path)


def refusal(path) -> str:
    with pytest.raises(ValueError) as caught:
        check_human(str(path))
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_states_and_actions_that_are_unknown_missing_or_twice_are_refused_by_name(tmp_path):
    path = tmp_path / "worker.pomdpx"
    states = [*STATES[:1], "pondering", *STATES[2:]]
    assert "unknown state 'pondering'; allowed: task_assigned (or TaskHuman)" in refusal(
        save(path, states=states)
    )
    assert "unknown action 'sing'" in refusal(save(path, actions=[*ACTIONS[:4], "sing"]))
    twice = [*STATES[:4], "Tired", *STATES[5:]]
    assert "state 'tired' is there twice: the second is 'Tired'" in refusal(
        save(path, states=twice)
    )
    n = len(STATES) - 1
    T, R = np.broadcast_to(np.eye(n), (5, n, n)), np.zeros((5, n))
    assert "state 'failure' is missing" in refusal(save(path, np.array(T), R, STATES[:n]))


def test_observations_and_a_discount_of_one_are_refused(tmp_path):
    path = tmp_path / "worker.pomdpx"
    assert "has 2 observations; allowed: none" in refusal(
        save(path, observations=["dark", "light"])
    )
    assert "discount is 1; allowed: below 1" in refusal(save(path, discount=1.0))


def test_a_malformed_file_is_refused_with_its_place(tmp_path):
    text = save(tmp_path / "good.pomdpx").read_text()
    for old, new, told in (
        ("<Discount>0.9</Discount>", "<Discount>0.9", "line"),
        (">1 0 0 0 0 0 0 0 0 0 0 0<", ">1 0 0 0 0 0 0 0 0 0 0 0s<", "0s"),
        (">1 0 0 0 0 0 0 0 0 0 0 0<", ">nan 0 0 0 0 0 0 0 0 0 0 0<", "nan"),
        (">1 0 0 0 0 0 0 0 0 0 0 0<", ">1.03 0 0 0 0 0 0 0 0 0 0 0<", "1.03"),
    ):
        assert old in text
        bad = tmp_path / "bad.pomdpx"
        bad.write_text(text.replace(old, new, 1))
        assert told in refusal(bad)
    assert "gone.pomdpx" in refusal(tmp_path / "gone.pomdpx")


def test_a_built_in_worker_becomes_a_model_of_the_planner():
    made = to_pomdp(built_in(), 0.9, "expert")
    assert made.fully_observable
    assert list(made.states) == list(STATES)
