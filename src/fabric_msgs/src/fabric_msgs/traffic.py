# SPDX-License-Identifier: BSD-3-Clause
"""How a Python node counts what it sends and deals with, and says so in its heartbeat.

The simulated cell holds its clock until every counted message sent has been handled, and a reader
of a record sees lost messages in the same numbers. Both rest on one promise: a heartbeat never
claims that a message was handled before everything the message caused was sent and counted.
"""

import threading
from collections.abc import Callable, Iterable
from typing import Any
from xmlrpc.client import ServerProxy

import rosgraph
import rospy

from fabric_msgs.msg import Heartbeat, Progress

QUEUE_SIZE = 1000  # messages; a counted message must not be dropped
#: Options of a subscription to pictures: of several that wait only the newest is taken, so that a
#: node that falls behind stays close to now. rospy looks no further than its buffer reaches, which
#: by default holds less than one picture.
PICTURES = {"queue_size": 1, "buff_size": 2**22}
NO_CONNECTIONS: Callable[[], int] = int


class Ledger:
    """Counts of one node: messages handled by input, messages sent by output. Not thread-safe."""

    def __init__(self) -> None:
        self._handled: dict[str, int] = {}
        self._sent: dict[str, int] = {}
        self._connections: dict[str, Callable[[], int]] = {}

    def declare_handled(self, topic: str) -> None:
        """List `topic` among the inputs, with a count of 0."""
        self._handled.setdefault(topic, 0)

    def declare_sent(self, topic: str, connections: Callable[[], int] = NO_CONNECTIONS) -> None:
        """List `topic` among the outputs; `connections` returns the subscribers connected now."""
        self._sent.setdefault(topic, 0)
        self._connections[topic] = connections

    def count_handled(self, topic: str, count: int | None = None) -> None:
        """Raise the count of an input by one, or set it to the sequence number `count`."""
        self._handled[topic] = self._handled.get(topic, 0) + 1 if count is None else count

    def count_sent(self, topic: str, count: int | None = None) -> None:
        """Raise the count of an output by one, or set it to the sequence number `count`."""
        self._sent[topic] = self._sent.get(topic, 0) + 1 if count is None else count

    def entries(self) -> tuple[list[Progress], list[Progress]]:
        """Return what was handled and what was sent, each in order of declaration."""
        handled = [Progress(topic, count, 0) for topic, count in self._handled.items()]
        sent = [
            Progress(topic, count, self._connections.get(topic, NO_CONNECTIONS)())
            for topic, count in self._sent.items()
        ]
        return handled, sent


class CountedPublisher:
    """A publisher whose messages are counted before they leave."""

    def __init__(self, traffic: "Traffic", topic: str, publisher: Any) -> None:
        self._traffic = traffic
        self._topic = topic
        self._publisher = publisher

    def publish(self, message: Any, count: int | None = None) -> None:
        """Count and send one message; `count` sets the count to the message's own sequence."""
        with self._traffic.lock:
            self._traffic.sent(self._topic, count)
            self._publisher.publish(message)

    def repeat(self, message: Any) -> None:
        """Send a message that repeats a counted one; it is not counted again."""
        with self._traffic.lock:
            self._publisher.publish(message)


class Traffic:
    """Traffic counter, heartbeat and callback lock of one node.

    rospy runs the callbacks of each topic in a thread of its own. `subscribe` and `serialised`
    put them behind `lock` (re-entrant), so that the node handles one message at a time. The
    10 Hz heartbeat runs on wall time, also while /clock stands still, and takes the same lock: a
    node that hangs in a callback falls silent.

    A thread that waits for other nodes must not hold the lock meanwhile; waiting on
    `threading.Condition(traffic.lock)` releases it.
    """

    def __init__(self, node_name: str, period: float = 0.1) -> None:
        """Start the heartbeat of `node_name` every `period` seconds (wall time).

        Call after rospy.init_node. Raises ValueError when the name is empty or the period is
        not positive.
        """
        if not node_name:
            raise ValueError("node_name is empty")
        if not period > 0.0:
            raise ValueError(f"period is {period} s; it must be positive")
        self.lock = threading.RLock()
        self._node_name = node_name
        self._ledger = Ledger()
        self._heartbeat = rospy.Publisher("heartbeat", Heartbeat, queue_size=QUEUE_SIZE)
        self._closed = threading.Event()
        rospy.on_shutdown(self.close)
        threading.Thread(target=self._beat, args=(period,), daemon=True).start()

    def publisher(self, topic: str, message_class: Any, latch: bool = False) -> CountedPublisher:
        """Advertise `topic` and list it among the counted outputs."""
        publisher = rospy.Publisher(topic, message_class, latch=latch, queue_size=QUEUE_SIZE)
        self.declare_sent(topic, publisher.get_num_connections)
        return CountedPublisher(self, topic, publisher)

    def subscribe(
        self, topic: str, message_class: Any, callback: Callable[[Any], None], **options: Any
    ) -> rospy.Subscriber:
        """Subscribe to a counted topic: `callback` runs alone and the message counts as handled
        when it returns. An exception is logged and the message counts as handled too: a node
        does not die from a message, and nobody waits for ever for it.

        options: as of rospy.Subscriber, such as PICTURES. A message that `queue_size` leaves out
        is one that was lost.
        """
        self.declare_handled(topic)

        def handle(message: Any) -> None:
            with self.lock:
                try:
                    callback(message)
                except Exception as error:  # the border of the node: log whatever it is
                    rospy.logerr_throttle(1.0, f"{self._node_name}: {topic}: {error!r}")
                self.handled(topic)

        return rospy.Subscriber(topic, message_class, handle, tcp_nodelay=True, **options)

    def serialised(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return `callback` behind the node's lock: for services, actions and uncounted topics."""

        def locked(*args: Any, **kwargs: Any) -> Any:
            with self.lock:
                return callback(*args, **kwargs)

        return locked

    def declare_handled(self, topic: str) -> None:
        """List an input that is counted by hand with `handled`."""
        with self.lock:
            self._ledger.declare_handled(topic)

    def declare_sent(self, topic: str, connections: Callable[[], int] = NO_CONNECTIONS) -> None:
        """List an output that is counted by hand with `sent`, such as a goal of an action."""
        with self.lock:
            self._ledger.declare_sent(topic, connections)

    def sent(self, topic: str, count: int | None = None) -> None:
        """Count a message that is about to be sent; `count` sets the count to its sequence."""
        with self.lock:
            self._ledger.count_sent(topic, count)

    def handled(self, topic: str, count: int | None = None) -> None:
        """Count a message as dealt with and send a heartbeat.

        Call it when everything the message caused has been sent. `count` sets the count to the
        message's own sequence number (topics that repeat a state).
        """
        with self.lock:
            self._ledger.count_handled(topic, count)
            self._publish()

    def entries(self) -> tuple[list[Progress], list[Progress]]:
        """Return what this node handled and what it sent, up to now."""
        with self.lock:
            return self._ledger.entries()

    def close(self) -> None:
        """Stop the periodic heartbeat. rospy calls it on shutdown."""
        self._closed.set()

    def _beat(self, period: float) -> None:
        while not self._closed.wait(period):
            with self.lock:
                self._publish()

    def _publish(self) -> None:
        message = Heartbeat(node=self._node_name)
        message.header.stamp = rospy.Time.now()
        message.handled, message.sent = self._ledger.entries()
        try:
            self._heartbeat.publish(message)
        except rospy.ROSException:
            self.close()  # the publisher is closed: the node is shutting down


def introduce(topics: Iterable[str]) -> None:
    """Tell the subscribers of these topics once more who publishes them.

    rospy drops a connection for good when its housekeeping polls the socket a moment before it is
    connected; repeating the master's notice makes the subscriber connect again, and leaves a
    connection that stands as it is. Nodes that do not answer are passed over.
    """
    master = rosgraph.Master(rospy.get_name())
    publishers, subscribers, _ = map(dict, master.getSystemState())
    for topic in map(rospy.resolve_name, topics):
        try:
            uris = [master.lookupNode(node) for node in publishers.get(topic, [])]
            for node in subscribers.get(topic, []):
                ServerProxy(master.lookupNode(node)).publisherUpdate("/master", topic, uris)
        except (OSError, rosgraph.MasterException) as error:
            rospy.logwarn("%s: %s", topic, error)
