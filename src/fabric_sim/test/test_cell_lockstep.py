# SPDX-License-Identifier: BSD-3-Clause
"""The lockstep against a graph of the test's own making, without ROS and without waiting."""

import pytest
from cell_helpers import ended, start, task

from fabric_sim.lockstep import Lockstep, Pace, Stalled


class Wall:
    """A clock that only waiting moves."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


class Graph:
    """Others who take `work` waits to deal with a stimulus."""

    def __init__(self, wall, work=1, absent=0):
        self.wall = wall
        self.work, self.absent, self.busy = work, absent, 0
        self.closed = False
        self.ready = True
        self.log = []
        self.react = lambda topic: None

    def wait(self, seconds):
        assert seconds > 0.0
        self.wall.now += min(seconds, 0.01)
        self.log.append("wait")
        self.busy = max(0, self.busy - 1)
        self.absent = max(0, self.absent - 1)

    def missing(self):
        return ["node motion has not shown itself"] if self.absent else []

    def forgive_losses(self):
        self.log.append("forgive")

    def outstanding(self):
        return ["node task has not handled 1 message(s) of truth"] if self.busy else []

    def show(self, output):
        self.log.append("show" if output else "stand")

    def send(self, stimulus):
        self.busy = self.work
        topic = stimulus.messages[0][0]
        self.log.append(topic)
        self.react(topic)


def setup(speed=0.0, **kwargs):
    wall = Wall()
    cell, _ = start()
    graph = Graph(wall, **kwargs)
    return cell, graph, Lockstep(cell, graph, Pace(speed, 20.0, 60.0), wall)


def test_it_waits_after_every_stimulus():
    _, graph, lockstep = setup(work=2)
    lockstep.tick()
    lockstep.tick()
    assert graph.log == [
        *["show", "show"],
        *["truth", "wait", "wait"],
        *["conveyor/state", "wait", "wait"],
        *["cell/containers", "wait", "wait"],
        *["human/activity", "wait", "wait"],
    ]


def test_time_stands_while_somebody_at_the_keys_has_yet_to_begin():
    cell, graph, lockstep = setup()
    graph.ready = False
    cell.on_task(task())

    def look(seconds):
        graph.log.append("wait")
        graph.closed = graph.log.count("stand") == 3

    graph.wait = look
    lockstep.run()
    assert "show" not in graph.log
    assert cell.now == 0.0


def test_it_waits_for_everybody_before_the_start():
    cell, graph, lockstep = setup(absent=3)
    lockstep.get_ready()
    assert graph.log == ["wait"] * 3 + ["forgive"]
    assert cell.now == 0.0


def test_losses_are_forgiven_when_nothing_changes_any_more():
    _, graph, lockstep = setup()
    graph.busy = 10**6
    lockstep.get_ready()
    assert graph.log[-1] == "forgive"
    assert graph.wall.now == pytest.approx(0.5, abs=0.02)


def test_a_silent_node_ends_the_run_with_its_name():
    _, graph, lockstep = setup(absent=10**6)
    with pytest.raises(Stalled, match="cannot start after 60 s: node motion has not shown itself"):
        lockstep.get_ready()


def test_unfinished_work_ends_the_run_with_node_and_topic():
    _, graph, lockstep = setup(work=10**6)
    lockstep.tick()
    with pytest.raises(Stalled, match="does not go on after 20 s: node task has not handled 1"):
        lockstep.tick()


def test_the_cell_freezes_in_the_middle_of_a_tick_when_the_task_ends():
    cell, graph, lockstep = setup()
    graph.react = lambda topic: cell.on_task(ended(task())) if "containers" in topic else None
    lockstep.tick()
    lockstep.tick()
    assert "human/activity" not in graph.log
    frozen = cell.now
    lockstep.tick()
    assert cell.now == frozen


def test_time_stands_without_a_task():
    cell, graph, lockstep = setup()
    cell.on_task(ended(task()))

    def stop_soon(output):
        graph.log.append("show" if output else "stand")
        graph.closed = graph.log.count("stand") == 3

    graph.show = stop_soon
    lockstep.run()
    assert cell.now == 0.0
    assert [word for word in graph.log if word != "wait"] == ["forgive", *["stand"] * 3]


@pytest.mark.parametrize(("speed", "seconds"), [(1.0, 2.0), (4.0, 0.5), (0.0, 0.0)])
def test_it_keeps_the_pace(speed, seconds):
    _, graph, lockstep = setup(speed=speed, work=0)
    for _ in range(40):
        lockstep.tick()
    assert graph.wall.now == pytest.approx(seconds, abs=0.06)


def test_time_lost_is_not_made_up_for():
    _, graph, lockstep = setup(speed=1.0, work=0)
    lockstep.tick()
    graph.wall.now += 5.0
    before = graph.wall.now
    for _ in range(10):
        lockstep.tick()
    assert graph.wall.now - before == pytest.approx(0.45, abs=0.06)


def test_a_closed_graph_ends_it_at_once():
    cell, graph, lockstep = setup(work=10**6)
    graph.react = lambda topic: setattr(graph, "closed", True)
    lockstep.run()
    assert cell.now == 0.1
