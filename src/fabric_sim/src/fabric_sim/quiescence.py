# SPDX-License-Identifier: BSD-3-Clause
"""When nobody has work left: counts of messages sent and handled, compared edge by edge.

A heartbeat counts a message as handled only after everything it caused was sent and counted. So
when the newest heartbeats of all nodes agree on every edge, no message is on its way and no node is
at work (docs/time.md).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple


class Edge(NamedTuple):
    """A counted topic on its way from one node to another (names as in heartbeats)."""

    topic: str
    publisher: str
    consumer: str


CELL = "cell"
_TABLE = (
    (CELL, "arm/move/result", "motion"),
    (CELL, "conveyor/state", "motion task"),
    (CELL, "cell/cubes", "motion"),
    (CELL, "cell/containers", "task"),
    (CELL, "human/warning", "motion task"),
    (CELL, "human/activity", "observation"),
    (CELL, "human/head", "observation"),
    (CELL, "truth", "recorder"),
    ("task", "task/state", "cell motion observation recorder"),
    ("task", "task/event", "observation recorder abps"),
    ("observation", "observation", "decision recorder abps"),
    ("decision", "decision", "motion recorder abps"),
    ("motion", "robot/state", "cell"),
    ("motion", "arm/move/goal", "cell"),
    ("motion", "arm/move/cancel", "cell"),
    ("abps", "abps/policy", "recorder"),
)
_SEEN = {  # who says it when cameras see the cell: topic, publisher
    "cell/cubes": "tracking",
    "cell/containers": "tracking",
    "human/warning": "gesture",
    "human/activity": "gesture",
    "human/head": "head",
}
_CAMERA_TABLE = (
    (CELL, "sim/scene", "cell_camera head_camera"),
    (CELL, "arm/tcp", "tracking motion"),
    (CELL, "sensors/load_cells", "tracking"),
    (CELL, "conveyor/state", "tracking"),
    ("task", "task/state", "tracking"),
    ("cell_camera", "cell/camera/rgb/camera_info", "tracking"),
    ("head_camera", "head/camera/camera_info", "head"),
    ("cell_camera", "cell/camera/rgb/image_raw", "tracking"),
    ("cell_camera", "cell/camera/depth/image", "tracking"),
    ("head_camera", "head/camera/image_raw", "head"),
    ("tracking", "human/hand", "gesture motion"),
    ("tracking", "cell/cubes", "gesture"),
)
#: Latched: what was sent before its consumer was there is on its way all the same.
_AWAITED = ("cell/camera/rgb/camera_info", "head/camera/camera_info")


def _edges(rows: Iterable[tuple[str, str, str]]) -> tuple[Edge, ...]:
    return tuple(
        Edge(topic, publisher, consumer)
        for publisher, topic, consumers in rows
        for consumer in consumers.split()
    )


EDGES = _edges(_TABLE)
#: With sensing:=camera the labels come from perception, which sees pictures and raw readings.
CAMERA_EDGES = _edges(
    (*((_SEEN.get(topic, who), topic, whom) for who, topic, whom in _TABLE), *_CAMERA_TABLE)
)


def nodes_of(edges: Iterable[Edge]) -> tuple[str, ...]:
    """Names of all nodes at these edges."""
    return tuple(sorted({name for edge in edges for name in (edge.publisher, edge.consumer)}))


NODES = nodes_of(EDGES)


@dataclass
class Counts:
    """What one node says of itself."""

    handled: Mapping[str, int] = field(default_factory=dict)
    sent: Mapping[str, int] = field(default_factory=dict)
    connections: Mapping[str, int] = field(default_factory=dict)  # subscribers of sent topics


class Quiescence:
    """Compares the newest counts of the expected nodes."""

    def __init__(self, expected: Iterable[str], edges: tuple[Edge, ...] = EDGES) -> None:
        """Expect these nodes; the cell itself is always one of them.

        Raises ValueError naming a node that has no counted topics.
        """
        self._nodes = {CELL, *expected}
        known = nodes_of(edges)
        unknown = sorted(self._nodes - set(known))
        if unknown:
            raise ValueError(f"expected node {unknown[0]!r}; allowed: {', '.join(known)}")
        self.topics = tuple(dict.fromkeys(edge.topic for edge in edges))
        self._edges = [e for e in edges if {e.publisher, e.consumer} <= self._nodes]
        self._counts: dict[str, Counts] = {}
        self._lost: dict[Edge, int] = {}

    def heard(self, node: str, counts: Counts) -> None:
        """Take in a heartbeat; nodes that are not expected are ignored."""
        if node in self._nodes:
            self._counts[node] = counts

    def missing(self, subscribers: Mapping[str, int] | None = None) -> list[str]:
        """What is not ready yet, as sentences: silent nodes, unconnected topics, cameras of which
        lens and place are not known to those who take the pictures.

        subscribers: how many subscribers of each topic are known to the ROS master. A publisher
        must be connected to all of them, so that a tool which listens too, such as a bag
        recorder, is not mistaken for a consumer.
        """
        silent = sorted(self._nodes - set(self._counts))
        if silent:
            return [f"node {name} has not shown itself" for name in silent]
        words = [self._edge_missing(edge) for edge in self._edges]
        for topic, (publisher, have, want) in self.unconnected(subscribers).items():
            words.append(f"{publisher} has {have} of {want} subscribers of {topic}")
        words += [self._edge_waiting(edge) for edge in self._edges if edge.topic in _AWAITED]
        return [w for w in words if w]

    def unconnected(
        self, subscribers: Mapping[str, int] | None = None
    ) -> dict[str, tuple[str, int, int]]:
        """Topics that lack connections: publisher, how many there are, how many are wanted."""
        lacking = {}
        for topic, publisher in {(e.topic, e.publisher): None for e in self._edges}:
            if publisher not in self._counts:
                continue
            have = self._counts[publisher].connections.get(topic, 0)
            consumers = sum(e.topic == topic for e in self._edges)
            want = max(consumers, (subscribers or {}).get(topic, 0))
            if have < want:
                lacking[topic] = (publisher, have, want)
        return lacking

    def forgive_losses(self) -> None:
        """Do not wait for messages sent before their consumers were there: call it once, when
        nothing is missing and no task has begun."""
        self._lost = {edge: max(0, self._on_the_way(edge)) for edge in self._edges}

    def outstanding(self) -> list[str]:
        """Who has work left, as sentences; empty when the graph is quiescent."""
        words = []
        for edge in self._edges:
            behind = self._on_the_way(edge) - self._lost.get(edge, 0)
            if behind > 0:
                words.append(_unhandled(edge, behind))
            elif behind < 0:
                words.append(
                    f"node {edge.publisher} has not counted {-behind} message(s) of {edge.topic} "
                    f"that {edge.consumer} has handled"
                )
        return words

    def _edge_missing(self, edge: Edge) -> str:
        if edge.topic not in self._counts[edge.publisher].sent:
            return f"node {edge.publisher} does not offer {edge.topic}"
        if edge.topic not in self._counts[edge.consumer].handled:
            return f"node {edge.consumer} does not listen to {edge.topic}"
        return ""

    def _edge_waiting(self, edge: Edge) -> str:
        behind = self._on_the_way(edge)
        return _unhandled(edge, behind) if behind > 0 else ""

    def _on_the_way(self, edge: Edge) -> int:
        sent = self._counts.get(edge.publisher, Counts()).sent.get(edge.topic, 0)
        handled = self._counts.get(edge.consumer, Counts()).handled.get(edge.topic, 0)
        return sent - handled


def _unhandled(edge: Edge, count: int) -> str:
    return (
        f"node {edge.consumer} has not handled {count} message(s) of {edge.topic} "
        f"from {edge.publisher}"
    )
