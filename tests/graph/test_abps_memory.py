# SPDX-License-Identifier: BSD-3-Clause
"""The ABPS node alone: what it knows of a person survives its death, and ends on request; it goes
on without a planner, and while a planner thinks."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest
import rospy

from fabric_abps import Job, Library, SelectorParameters, train
from fabric_bringup import ports
from fabric_msgs.msg import Decision, Heartbeat, Observation, PolicyChoice, TaskEvent, TypeBelief
from fabric_msgs.srv import (
    ResetTypes,
    SelectPolicy,
    SelectPolicyResponse,
    SetModel,
    SetModelRequest,
    SetModelResponse,
)

DEADLINE = 60.0  # s, wall time for any one condition
NODE = Path(__file__).parents[2] / "src/fabric_abps/nodes/abps_node.py"
INDEX = """
tiny:
  base: one
  policies:
    - {name: one, model: one.pomdpx, about: One.}
    - {name: two, model: two.pomdpx, about: Two.}
"""
IDLE, WARNING = 33, 17


def run_job(job: Job) -> list[tuple[float, list[int]]]:
    """Two types of people: one idles, one warns; each has a policy that suits it."""
    code = IDLE if job.type == "idler" else WARNING
    suits = (job.type == "idler") == (job.policy == "one")
    return [(3.0 + 2.0 * suits + 0.01 * task, [code] * 5) for task in range(job.tasks)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A library and its models."""
    folder = tmp_path_factory.mktemp("abps")
    (folder / "library.yaml").write_text(INDEX)
    for name in ("one", "two"):
        (folder / f"{name}.pomdpx").write_text(f"<!-- {name} -->")
    library = Library.load(folder / "library.yaml", "tiny")
    train(library, ("idler", "warner"), run_job, 6, 1).save(folder / "models.npz")
    return folder


@pytest.fixture(scope="module")
def master(folder: Path) -> Iterator[str]:
    """Address of a ROS master that this process is a node of."""
    port = ports.any_free()
    environment = {
        "ROS_MASTER_URI": f"http://localhost:{port}",
        "ROS_HOSTNAME": "localhost",
        "ROS_LOG_DIR": str(folder / "log"),
    }
    patch = pytest.MonkeyPatch()
    for name, value in environment.items():
        patch.setenv(name, value)
    core = subprocess.Popen(["roscore", "-p", str(port)], stdout=subprocess.PIPE, text=True)
    assert core.stdout is not None
    assert any("started core service" in line for line in core.stdout)
    rospy.init_node("somebody", anonymous=True, disable_signals=True)
    yield environment["ROS_MASTER_URI"]
    rospy.signal_shutdown("the test is over")
    core.terminate()
    core.communicate(timeout=DEADLINE)
    patch.undo()


class Robot(rospy.SubscribeListener):
    """What the rest of the graph says to the node, and what the node says."""

    def __init__(self) -> None:
        super().__init__()
        self._news = threading.Condition()
        self._beliefs: list[TypeBelief] = []
        self._choices: list[PolicyChoice] = []
        self._listeners, self._beats, self._handled = 0, 0, {}
        self._publish = {
            kind: rospy.Publisher(topic, kind, subscriber_listener=self, queue_size=100)
            for topic, kind in (
                ("observation", Observation),
                ("decision", Decision),
                ("task/event", TaskEvent),
            )
        }
        rospy.Subscriber("abps/type_belief", TypeBelief, self._take)
        rospy.Subscriber("abps/policy", PolicyChoice, self._learn)
        rospy.Subscriber("heartbeat", Heartbeat, self._count)

    def peer_subscribe(self, *_: object) -> None:
        with self._news:
            self._listeners += 1
            self._news.notify_all()

    def _take(self, belief: TypeBelief) -> None:
        with self._news:
            self._beliefs.append(belief)
            self._news.notify_all()

    def _learn(self, choice: PolicyChoice) -> None:
        with self._news:
            self._choices.append(choice)
            self._news.notify_all()

    def _count(self, heartbeat: Heartbeat) -> None:
        with self._news:
            self._beats += 1
            self._handled = {entry.topic: entry.count for entry in heartbeat.handled}
            self._news.notify_all()

    def meet(self) -> TypeBelief:
        """Wait until a node that was just started listens; return its first belief."""
        with self._news:
            assert self._news.wait_for(lambda: self._listeners and self._beliefs, DEADLINE)
            assert self._news.wait_for(lambda: self._listeners >= len(self._publish), DEADLINE)
            return self._beliefs[-1]

    def chosen(self, count: int) -> list[tuple[int, str]]:
        """Task and policy of so many choices, as soon as there are as many."""
        with self._news:
            assert self._news.wait_for(lambda: len(self._choices) >= count, DEADLINE)
            return [(choice.task_id, choice.policy) for choice in self._choices]

    def hear(self, beats: int) -> dict[str, int]:
        """Wait for some more heartbeats; return what has been handled by the last of them."""
        with self._news:
            until = self._beats + beats
            assert self._news.wait_for(lambda: self._beats >= until, DEADLINE)
            return dict(self._handled)

    def forget(self) -> None:
        with self._news:
            self._listeners, self._beliefs, self._choices = 0, [], []

    def _show(self, task_id: int, number: int, code: int, **fields) -> None:
        message = Observation(task_id=task_id, sequence=number, detected=True, **fields)
        message.idle, message.warning = code == IDLE, code == WARNING
        self._publish[Observation].publish(message)

    def decide(self, task_id: int, number: int, code: int) -> None:
        """The person does something and the planner answers it; wait until the node has handled
        both."""
        self._show(task_id, number, code, trigger=Observation.TRIGGER_ACTION_CHANGE)
        self._publish[Decision].publish(Decision(task_id=task_id, observation_sequence=number))
        both = {"observation": number, "decision": number}
        with self._news:
            assert self._news.wait_for(lambda: self._handled.items() >= both.items(), DEADLINE)

    def play(self, task_id: int, code: int) -> TypeBelief:
        """A whole task in which the person does one thing; return the belief after it."""
        for number in range(5):
            self._show(task_id, number + 1, code, task_success=number == 4)
        self._publish[TaskEvent].publish(TaskEvent(task_id=task_id, kind=TaskEvent.TASK_SUCCEEDED))
        with self._news:
            done = self._news.wait_for(lambda: self._beliefs[-1].task_id == task_id, DEADLINE)
            assert done
            return self._beliefs[-1]


@contextmanager
def node(
    master: str, folder: Path, memory: Path, robot: Robot, **settings: object
) -> Iterator[subprocess.Popen]:
    """The ABPS node of P07; it dies by SIGKILL."""
    robot.forget()
    settings = vars(SelectorParameters()) | {"criterion": "greedy"} | settings
    parameters = {
        "library": str(folder),
        "scenario": "tiny",
        "person": "P07",
        "memory": str(memory),
    }
    ServerProxy(master).setParam("/test", "/abps", parameters | {"selector": settings})
    process = subprocess.Popen([sys.executable, str(NODE)], stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=DEADLINE)


def select(task_id: int) -> SelectPolicyResponse:
    return rospy.ServiceProxy("abps/select", SelectPolicy)(task_id, 1)


def test_the_belief_survives_a_kill_and_ends_on_request(master, folder, tmp_path) -> None:
    robot = Robot()
    with node(master, folder, tmp_path, robot):
        assert robot.meet().probability == (0.5, 0.5)
        assert "new person" in select(1).reason
        before = robot.play(1, WARNING)
        assert before.probability[1] > 0.6
    with node(master, folder, tmp_path, robot):
        assert robot.meet().probability == before.probability
        assert select(2).policy == "two"
        assert rospy.ServiceProxy("abps/reset", ResetTypes)().accepted
    with node(master, folder, tmp_path, robot):
        assert robot.meet().probability == (0.5, 0.5)
        assert "new person" in select(3).reason


def test_the_next_person_is_another_and_who_comes_back_is_known(master, folder, tmp_path) -> None:
    robot = Robot()
    reset = rospy.ServiceProxy("abps/reset", ResetTypes)
    with node(master, folder, tmp_path, robot):
        robot.meet()
        select(1)
        known = robot.play(1, WARNING).probability
        rospy.set_param("/abps/person", "P08")
        assert "new person" in reset().reason
        select(2)
        other = robot.play(2, IDLE).probability
        assert other[0] > 0.6
        rospy.set_param("/abps/person", "P07")
        assert "1 tasks" in reset().reason
    with node(master, folder, tmp_path, robot):
        assert robot.meet().probability == known


def test_a_file_that_cannot_be_used_ends_the_node_and_stays(master, folder, tmp_path) -> None:
    robot = Robot()
    kept = tmp_path / "P07_tiny.json"
    kept.write_text("{")
    with node(master, folder, tmp_path, robot) as process:
        _, told = process.communicate(timeout=DEADLINE)
    assert process.returncode == 1
    assert f"abps: {kept}: not a JSON file" in told
    assert kept.read_text() == "{"


def test_without_a_planner_the_policy_stays_and_the_task_is_credited_to_it(
    master, folder, tmp_path
) -> None:
    robot = Robot()
    with node(master, folder, tmp_path, robot, switch_inside=True, switch_margin=0.0):
        robot.meet()
        assert select(1).policy == "one"
        for number in range(1, 4):  # any policy but "one" is better with a person who warns
            robot.decide(1, number, WARNING)
        assert select(2).policy == "two"  # nothing was switched before
    kept = json.loads((tmp_path / "P07_tiny.json").read_text())
    assert len(kept["state"]["p_values"]) == 1  # none for a task that several policies share


class Planner:
    """Takes another model, after two heartbeats of the one who asks and after `meanwhile`."""

    def __init__(self, robot: Robot, meanwhile: Callable[[], None]) -> None:
        self._robot, self._meanwhile = robot, meanwhile
        self.handled: list[dict[str, int]] = []
        self._service = rospy.Service("planner/set_model", SetModel, self._set_model)

    def _set_model(self, request: SetModelRequest) -> SetModelResponse:
        self._meanwhile()
        self.handled.append(self._robot.hear(2))
        return SetModelResponse(accepted=request.keep_belief)

    def leave(self) -> None:
        self._service.shutdown()


def test_while_the_planner_thinks_the_heart_beats_and_the_next_message_waits(
    master, folder, tmp_path
) -> None:
    robot, selected = Robot(), []
    next_task = threading.Thread(target=lambda: selected.append(select(2)))
    planner = Planner(robot, next_task.start)
    try:
        with node(master, folder, tmp_path, robot, switch_inside=True, switch_margin=0.0):
            robot.meet()
            assert select(1).policy == "one"
            robot.decide(1, 1, WARNING)
            next_task.join(DEADLINE)
            assert robot.chosen(3) == [(1, "one"), (1, "two"), (2, selected[0].policy)]
    finally:
        planner.leave()
    [handled] = planner.handled
    assert handled["observation"] + handled["decision"] == 1  # not the later one of the two
