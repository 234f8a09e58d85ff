# SPDX-License-Identifier: BSD-3-Clause
"""Whether a graph of nodes is complete, judged by the heartbeats of its nodes."""

from collections.abc import Iterable

from fabric_msgs.msg import Heartbeat


class Readiness:
    """Collects heartbeats until the expected nodes have found each other."""

    def __init__(self, nodes: Iterable[str]) -> None:
        self._nodes = tuple(nodes)
        self._newest: dict[str, Heartbeat] = {}

    def heard(self, heartbeat: Heartbeat) -> None:
        """Take a heartbeat; the newest of each node counts."""
        self._newest[heartbeat.node] = heartbeat

    def missing(self) -> list[str]:
        """Return what is still missing, in words; empty when the graph is complete.

        Every expected node must have shown itself, and every counted output must be connected to
        as many subscribers as there are expected nodes that handle it.
        """
        missing = [f"node {name} is silent" for name in self._nodes if name not in self._newest]
        for name in self._nodes:
            if name not in self._newest:
                continue
            for output in self._newest[name].sent:
                wanted = self._consumers(output.topic)
                if output.connections < wanted:
                    missing.append(
                        f"{output.topic} of {name} has {output.connections} of {wanted} subscribers"
                    )
        return missing

    def sent(self, node: str, topic: str) -> int:
        """Return how many messages of `topic` a node says it has sent."""
        beat = self._newest.get(node)
        counts = {entry.topic: entry.count for entry in beat.sent} if beat else {}
        return counts.get(topic, 0)

    def _consumers(self, topic: str) -> int:
        return sum(
            any(entry.topic == topic for entry in self._newest[name].handled)
            for name in self._nodes
            if name in self._newest
        )
