# SPDX-License-Identifier: BSD-3-Clause
"""Recorded pictures through the perception nodes: which topics go in, when everybody is done,
and what came out.

A bag need not call its topics as we do: drivers' names are given as `own=recorded`.
"""

import bisect
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fabric_msgs.msg import HumanActivity

PICTURES = ("cell/camera/rgb/image_raw", "cell/camera/depth/image", "head/camera/image_raw")
INPUTS = (
    *PICTURES,
    "cell/camera/rgb/camera_info",
    "cell/camera/depth/camera_info",
    "head/camera/camera_info",
    "/tf_static",
    "arm/tcp",
    "conveyor/state",
    "sensors/load_cells",
    "task/event",
    "task/state",
)
LATCHED = ("task/state", "/tf_static")
OUTPUTS = (
    "human/head",
    "human/hand",
    "human/activity",
    "human/warning",
    "cell/cubes",
    "cell/containers",
    "observation",
)
KEPT = ("task/state", "task/event", "model_info")  # as recorded, so that a decision replay is whole
GESTURES = {
    HumanActivity.IDLE: "idle",
    HumanActivity.GRASP: "grasp",
    HumanActivity.WARN: "warn",
    HumanActivity.OTHER: "other",
}
SAME_MOMENT = 0.06  # s, between a percept and the recorded one it is compared with


class PictureReplayError(ValueError):
    """A recording without what is needed; the message names it."""


def parse_names(text: str) -> dict[str, str]:
    """Return {recorded: own} of `own=recorded,own=recorded`; raises PictureReplayError."""
    names: dict[str, str] = {}
    for part in filter(None, (p.strip() for p in text.split(","))):
        own, sign, recorded = part.partition("=")
        if not sign or own not in INPUTS or not recorded:
            raise PictureReplayError(
                f"'{part}' is no own=recorded; own names are {', '.join(INPUTS)}"
            )
        names[recorded.strip("/")] = own
    return names


def inputs_of(recorded: Iterable[str], names: Mapping[str, str]) -> dict[str, str]:
    """Return {recorded topic: own topic} of what is to be played.

    A topic in a namespace counts by its end. Raises PictureReplayError when no topic holds
    pictures, or two are the same.
    """
    chosen: dict[str, str] = {}
    for topic in recorded:
        plain = topic.strip("/")
        own = names.get(plain) or next((name for name in INPUTS if _is(plain, name)), None)
        if own is None or (own in names.values() and plain not in names):
            continue
        if own in chosen.values():
            raise PictureReplayError(f"{own} is there twice: {topic} and another; name the one")
        chosen[topic] = own
    if not set(chosen.values()) & set(PICTURES):
        raise PictureReplayError(f"holds no pictures: none of {', '.join(PICTURES)}")
    return chosen


def holds_pictures(recorded: Iterable[str], names: Mapping[str, str]) -> bool:
    """Whether any of the topics of a bag can be replayed through perception."""
    try:
        return bool(inputs_of(recorded, names))
    except PictureReplayError:
        return False


class Books:
    """Who has dealt with what, from heartbeats: complete when every message sent was handled.

    nodes: the names, as in heartbeats, of those that work here.
    """

    def __init__(self, nodes: Iterable[str]) -> None:
        self._nodes = frozenset(nodes)
        self._handled: dict[str, dict[str, int]] = {}
        self._sent: dict[str, dict[str, tuple[int, int]]] = {}
        self._mine: Counter[str] = Counter()

    def heard(self, heartbeat: Any) -> None:
        """Take a Heartbeat; those of other nodes are passed over."""
        if heartbeat.node in self._nodes:
            self._handled[heartbeat.node] = {p.topic: p.count for p in heartbeat.handled}
            self._sent[heartbeat.node] = {p.topic: (p.count, p.connections) for p in heartbeat.sent}

    def sent(self, topic: str) -> None:
        """Count a message of our own."""
        self._mine[topic] += 1

    def missing(self) -> list[str]:
        """Nodes that have not been heard, and topics between them that are not connected."""
        silent = sorted(self._nodes - set(self._handled))
        loose = [
            f"{node}: {topic}"
            for node, topics in self._sent.items()
            for topic, (_, connections) in topics.items()
            if connections < len(self.listeners(topic)) + (topic in OUTPUTS)
        ]
        return silent or loose

    def listeners(self, topic: str) -> list[str]:
        """Nodes that count a topic among their inputs."""
        return [node for node, topics in self._handled.items() if topic in topics]

    def behind(self) -> list[str]:
        """Nodes that have messages left, as far as heartbeats tell."""
        totals = Counter(self._mine)
        for topics in self._sent.values():
            for topic, (count, _) in topics.items():
                totals[topic] += count
        return [
            f"{node}: {topic} {count} of {totals[topic]}"
            for node, topics in self._handled.items()
            for topic, count in topics.items()
            if count < totals[topic]
        ]

    def published(self, topic: str) -> int:
        """How many messages the nodes have sent on a topic."""
        return sum(topics.get(topic, (0, 0))[0] for topics in self._sent.values())


@dataclass
class Percepts:
    """What was perceived, replayed or as recorded. Times are stamps, s."""

    counts: Counter = field(default_factory=Counter)
    looks: dict[float, bool | None] = field(default_factory=dict)  # None: no marker in view
    gestures: dict[float, int] = field(default_factory=dict)  # HumanActivity.*
    hands: Counter = field(default_factory=Counter)  # visible or not
    changes: int = 0  # of containers
    triggers: Counter = field(default_factory=Counter)

    def take(self, topic: str, message: Any) -> None:
        """Take a message of one of OUTPUTS."""
        self.counts[topic] += 1
        t = message.stamp.to_sec() if topic == "human/warning" else message.header.stamp.to_sec()
        if topic == "human/head":
            self.looks[t] = bool(message.looking_around) if message.visible else None
        elif topic == "human/activity":
            posterior = list(message.posterior)
            self.gestures[t] = max(range(len(posterior)), key=posterior.__getitem__)
        elif topic == "human/hand":
            self.hands[bool(message.visible)] += 1
        elif topic == "cell/containers":
            self.changes = max(self.changes, int(message.sequence))
        elif topic == "observation":
            self.triggers[int(message.trigger)] += 1

    def summary(self) -> dict[str, Any]:
        """Return figures to print and to keep; what was not perceived at all is left out."""
        told: dict[str, Any] = {"messages": dict(self.counts)}
        if self.looks:
            states = [state for _, state in sorted(self.looks.items())]
            seen = [state for state in states if state is not None]
            told["head_visible"] = len(seen) / len(states)
            told["looks"] = sum(
                now and not before for before, now in zip([False, *seen], seen, strict=False)
            )
        if self.gestures:
            shares = Counter(self.gestures.values())
            told["gestures"] = {
                name: shares[number] / len(self.gestures) for number, name in GESTURES.items()
            }
        if self.hands:
            told["hand_visible"] = self.hands[True] / sum(self.hands.values())
        if self.counts["human/warning"]:
            told["warnings"] = self.counts["human/warning"]
        if self.counts["cell/containers"]:
            told["container_changes"] = self.changes
        return told


def agreement(replayed: Percepts, recorded: Percepts) -> dict[str, float]:
    """Return how often both say the same of the same moment: looking around and gesture.

    Moments that only one of them knows are left out, and so is a figure without any.
    """
    pairs: dict[str, list[bool]] = defaultdict(list)
    for name, mine, theirs in (
        ("looking_around", replayed.looks, recorded.looks),
        ("gesture", replayed.gestures, recorded.gestures),
    ):
        times = sorted(theirs)
        for t, said in mine.items():
            other = _nearest(times, theirs, t)
            if said is not None and other is not None:
                pairs[name].append(said == other)
    return {name: sum(same) / len(same) for name, same in pairs.items()}


def report(summary: Mapping[str, Any]) -> str:
    """Return the summary as lines for a reader."""
    lines = [
        f"{summary['pictures']} pictures of {summary['duration_s']:.1f} s replayed in "
        f"{summary['wall_s']:.1f} s"
    ]
    rows = _rows(summary["replayed"])
    recorded = _rows(summary.get("recorded", {}))
    lines.append(f"{'':<24}{'replayed':>10}{'recorded':>10}")
    for name, value in rows.items():
        lines.append(f"{name:<24}{value:>10}{recorded.get(name, '-'):>10}")
    for name, share in summary.get("agreement", {}).items():
        lines.append(f"{name.replace('_', ' ')} agrees with the recording in {100 * share:.1f} %")
    return "\n".join(lines)


def _rows(told: Mapping[str, Any]) -> dict[str, str]:
    rows = {}
    for name, text in (("head_visible", "helmet in view"), ("hand_visible", "hand in view")):
        if name in told:
            rows[text] = f"{100 * told[name]:.1f} %"
    for name, text in (
        ("looks", "looks around"),
        ("warnings", "warnings"),
        ("container_changes", "container changes"),
    ):
        if name in told:
            rows[text] = str(told[name])
    for name, share in told.get("gestures", {}).items():
        rows[f"gesture {name}"] = f"{100 * share:.1f} %"
    if "observation" in told.get("messages", {}):
        rows["observations"] = str(told["messages"]["observation"])
    return rows


def _is(topic: str, name: str) -> bool:
    name = name.strip("/")
    return topic == name or topic.endswith("/" + name)


def _nearest(times: Sequence[float], states: Mapping[float, Any], t: float) -> Any:
    """The state at the time next to t; times: (n,) of the states, rising."""
    at = bisect.bisect(times, t)
    near = [other for other in times[max(at - 1, 0) : at + 1] if abs(other - t) <= SAME_MOMENT]
    return states[min(near, key=lambda other: abs(other - t))] if near else None
