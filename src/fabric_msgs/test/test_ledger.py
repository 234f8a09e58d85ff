# SPDX-License-Identifier: BSD-3-Clause
"""The counts behind a heartbeat, without a master."""

from fabric_msgs.msg import Heartbeat
from fabric_msgs.traffic import Ledger


def counts(entries):
    return {entry.topic: entry.count for entry in entries}


def test_declared_topics_are_listed_with_a_count_of_zero():
    ledger = Ledger()
    ledger.declare_handled("observation")
    ledger.declare_sent("decision", lambda: 3)
    handled, sent = ledger.entries()
    assert counts(handled) == {"observation": 0}
    assert [(entry.topic, entry.count, entry.connections) for entry in sent] == [("decision", 0, 3)]


def test_counts_rise_by_one():
    ledger = Ledger()
    for _ in range(3):
        ledger.count_handled("a")
        ledger.count_sent("b")
    handled, sent = ledger.entries()
    assert counts(handled) == {"a": 3}
    assert counts(sent) == {"b": 3}


def test_a_sequence_number_sets_the_count():
    ledger = Ledger()
    ledger.count_handled("robot/state", 7)
    ledger.count_sent("robot/state", 9)
    handled, sent = ledger.entries()
    assert counts(handled) == {"robot/state": 7}
    assert counts(sent) == {"robot/state": 9}


def test_declaring_again_keeps_the_count():
    ledger = Ledger()
    ledger.count_sent("b")
    ledger.declare_sent("b", lambda: 1)
    assert counts(ledger.entries()[1]) == {"b": 1}


def test_messages_and_traffic_come_from_one_package():
    assert Heartbeat(node="x").node == "x"
