# SPDX-License-Identifier: BSD-3-Clause
"""A graph is complete when all nodes are there and every output has found its consumers."""

from test_results import row

from fabric_msgs.msg import Heartbeat, Progress
from fabric_study.progress import progress_line
from fabric_study.readiness import Readiness


def beat(node, handled=(), **sent):
    """A heartbeat; `sent` gives (count, connections) by topic."""
    return Heartbeat(
        node=node,
        handled=[Progress(topic, 0, 0) for topic in handled],
        sent=[Progress(topic, *numbers) for topic, numbers in sent.items()],
    )


def test_a_silent_node_is_named():
    readiness = Readiness(["task", "recorder"])
    readiness.heard(beat("task"))
    assert readiness.missing() == ["node recorder is silent"]


def test_an_output_must_reach_every_expected_consumer():
    readiness = Readiness(["task", "recorder", "motion"])
    readiness.heard(beat("task", event=(0, 1)))
    readiness.heard(beat("recorder", handled=["event"]))
    readiness.heard(beat("motion", handled=["event"]))
    assert readiness.missing() == ["event of task has 1 of 2 subscribers"]
    readiness.heard(beat("task", event=(0, 2)))
    assert readiness.missing() == []


def test_nodes_that_are_not_expected_do_not_matter():
    readiness = Readiness(["task"])
    readiness.heard(beat("task", event=(0, 0)))
    readiness.heard(beat("abps", handled=["event"]))
    assert readiness.missing() == []


def test_the_newest_count_of_an_output_is_told():
    readiness = Readiness(["recorder"])
    assert readiness.sent("recorder", "results") == 0
    readiness.heard(beat("recorder", results=(3, 0)))
    assert readiness.sent("recorder", "results") == 3
    assert readiness.sent("recorder", "truth") == 0


def test_the_progress_line_tells_the_task_in_words():
    line = progress_line(row(task=2), 10)
    assert line.startswith("task 2/10  success  reward   1.50  warnings 0    20.0 s    7 decisions")
    assert "person 1 right 0 wrong, robot 0 right 0 wrong  (expert, proactive)" in line
    assert "aborted" in progress_line(row(success=None), 10)
