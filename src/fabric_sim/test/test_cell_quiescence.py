# SPDX-License-Identifier: BSD-3-Clause
"""Quiescence: who is named when work is left, and when nobody is."""

import pytest

from fabric_sim.quiescence import CAMERA_EDGES, EDGES, NODES, Counts, Quiescence, nodes_of


def counts(node: str, edges=EDGES, **changes: int) -> Counts:
    """Counts of a node at rest, all zero; changes: topic with __ for / = count."""
    changed = {topic.replace("__", "/"): count for topic, count in changes.items()}
    sent = {e.topic: changed.get(e.topic, 0) for e in edges if e.publisher == node}
    handled = {e.topic: changed.get(e.topic, 0) for e in edges if e.consumer == node}
    connections = {topic: sum(e.topic == topic for e in edges) for topic in sent}
    return Counts(handled, sent, connections)


@pytest.fixture
def everybody() -> Quiescence:
    graph = Quiescence(NODES)
    for node in NODES:
        graph.heard(node, counts(node))
    return graph


def test_silent_nodes_are_named():
    graph = Quiescence(["motion", "task"])
    graph.heard("task", counts("task"))
    assert graph.missing() == [
        "node cell has not shown itself",
        "node motion has not shown itself",
    ]


def test_a_complete_graph_at_rest_is_ready_and_quiet(everybody):
    assert everybody.missing() == []
    assert everybody.outstanding() == []


def test_a_message_on_its_way_names_consumer_and_topic(everybody):
    everybody.heard("cell", counts("cell", cell__containers=1))
    assert everybody.outstanding() == [
        "node task has not handled 1 message(s) of cell/containers from cell"
    ]


def test_work_passed_on_is_still_outstanding(everybody):
    everybody.heard("cell", counts("cell", cell__containers=1))
    everybody.heard("task", counts("task", cell__containers=1, task__event=2))
    words = "\n".join(everybody.outstanding())
    assert "cell/containers" not in words
    for consumer in ("observation", "recorder", "abps"):
        assert f"node {consumer} has not handled 2 message(s) of task/event" in words


def test_a_heartbeat_that_lags_behind_its_message_keeps_the_graph_busy(everybody):
    everybody.heard("decision", counts("decision", observation=1, decision=0))
    assert "node observation has not counted 1 message(s) of observation" in "\n".join(
        everybody.outstanding()
    )


def test_the_whole_chain_comes_to_rest(everybody):
    everybody.heard("cell", counts("cell", human__activity=3, human__head=3, robot__state=5))
    everybody.heard(
        "observation", counts("observation", human__activity=3, human__head=3, observation=1)
    )
    everybody.heard("decision", counts("decision", observation=1, decision=1))
    everybody.heard("motion", counts("motion", decision=1, robot__state=5))
    assert everybody.outstanding() != []
    everybody.heard("recorder", counts("recorder", observation=1, decision=1))
    everybody.heard("abps", counts("abps", observation=1, decision=1))
    assert everybody.outstanding() == []


def test_absent_nodes_are_not_waited_for():
    graph = Quiescence(["task", "motion", "observation", "decision"])
    for node in ("cell", "task", "motion", "observation", "decision"):
        graph.heard(node, counts(node, truth=9, task__event=0))
    graph.heard("recorder", counts("recorder"))
    assert graph.missing() == []
    assert graph.outstanding() == []


def test_a_topic_without_its_subscribers_is_named(everybody):
    lonely = counts("observation")
    everybody.heard("observation", Counts(lonely.handled, lonely.sent, {"observation": 2}))
    assert everybody.missing() == ["observation has 2 of 3 subscribers of observation"]
    assert everybody.unconnected() == {"observation": ("observation", 2, 3)}


def test_other_listeners_do_not_count_as_consumers(everybody):
    assert everybody.missing({"decision": 4}) == ["decision has 3 of 4 subscribers of decision"]
    assert everybody.missing({"decision": 3, "markers": 5}) == []


def test_a_topic_nobody_offers_is_named(everybody):
    everybody.heard("motion", Counts(counts("motion").handled, {}, {}))
    assert "node motion does not offer arm/move/goal" in everybody.missing()


def test_what_was_lost_before_the_start_is_forgiven(everybody):
    everybody.heard("task", counts("task", task__state=2))
    everybody.heard("cell", counts("cell", task__state=1))
    everybody.heard("recorder", counts("recorder", task__state=2))
    everybody.forgive_losses()
    assert everybody.outstanding() == []
    everybody.heard("task", counts("task", task__state=3))
    assert len(everybody.outstanding()) == 4


def test_an_unknown_node_is_refused_with_the_allowed_ones():
    with pytest.raises(ValueError, match="'planner'; allowed: abps, cell, decision, motion"):
        Quiescence(["planner"])


def test_a_run_waits_until_every_camera_is_known_to_who_takes_its_pictures():
    nodes = nodes_of(CAMERA_EDGES)
    graph = Quiescence(nodes, CAMERA_EDGES)
    for node in nodes:
        graph.heard(node, counts(node, CAMERA_EDGES))
    told = {"cell": {"cell__camera__rgb__camera_info": 1}, "head": {"head__camera__camera_info": 1}}
    for name, told_by in told.items():
        graph.heard(f"{name}_camera", counts(f"{name}_camera", CAMERA_EDGES, **told_by))
    graph.heard("head", counts("head", CAMERA_EDGES, **told["head"]))
    assert graph.missing() == [
        "node tracking has not handled 1 message(s) of cell/camera/rgb/camera_info from cell_camera"
    ]
    graph.heard("tracking", counts("tracking", CAMERA_EDGES, **told["cell"]))
    assert graph.missing() == []
