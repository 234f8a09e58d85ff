# SPDX-License-Identifier: BSD-3-Clause
"""events.csv: what it says, and that its hash tells every difference."""

import hashlib
import itertools

import pytest

from fabric_msgs.msg import Decision, Observation, TaskEvent, TaskState
from fabric_study.event_log import EventLogWriter, digest, digest_line
from fabric_study.event_rows import LOG_COLUMNS
from fabric_study.meter import TaskMeter
from fabric_study.stamps import to_stamp

RIGHT = dict(kind=TaskEvent.SUBTASK_SUCCEEDED, by=TaskEvent.BY_ROBOT, cube_id=1, cube_colour=3)
LATE = dict(planning_time=0.7, nodes=12, deadline_missed=True)


def message(message_class, t, sequence, **fields):
    made = message_class(task_id=2, sequence=sequence, **fields)
    made.header.stamp = to_stamp(t)
    return made


def messages(**changed):
    """An observation with its decision in the instant of an event, and one later."""
    decision = dict(
        action=Decision.GRASP, action_index=3, observation_index=5, model_hash="abcdef" * 9
    )
    decision |= dict(belief=[0.25, 0.75])
    return [
        message(Decision, 1.5, 1, **decision | changed),
        message(Observation, 1.5, 1, idle=True, subtask_elapsed=0.25, failed_attempts=2),
        message(TaskEvent, 1.5, 1, container="inspected", score=1, **RIGHT),
        message(Decision, 4.55, 2, **decision),
        message(Observation, 4.55, 2, trigger=Observation.TRIGGER_TIMEOUT, detected=True),
    ]


def log(given):
    meter = TaskMeter(
        TaskState(task_id=2, seed=77, scenario="inspection"), "", "models/mine.pomdpx"
    )
    take = {Decision: meter.on_decision, Observation: meter.on_observation}
    for each in given:
        take.get(type(each), meter.on_event)(each)
    return meter.log()


def test_a_task_reads_as_it_happened():
    head = ("mine", 2, 77)
    grasp = "grasp action=3 symbol=5 belief=1:0.750000 model=abcdefab"
    assert log(messages()) == [
        (*head, "1.500", "event", 1,
         "subtask_succeeded by=robot cube=1 colour=3 container=inspected score=1"),
        (*head, "1.500", "observation", 1,
         "start idle subtask_elapsed=0.250 waiting_time=0.000 failed_attempts=2"),
        (*head, "1.500", "decision", 1, grasp),
        (*head, "4.550", "observation", 2,
         "timeout detected subtask_elapsed=0.000 waiting_time=0.000 failed_attempts=0"),
        (*head, "4.550", "decision", 2, grasp),
    ]  # fmt: skip


def test_the_order_of_arrival_does_not_matter():
    expected = log(messages())
    assert all(log(order) == expected for order in itertools.permutations(messages()))


def written(path, rows):
    writer = EventLogWriter(path)
    writer.write_task(rows)
    writer.close()
    return path


def test_what_planning_took_does_not_show_and_what_it_decided_does(tmp_path):
    plain = digest(written(tmp_path / "plain", log(messages())))
    assert digest(written(tmp_path / "late", log(messages(**LATE)))) == plain
    for number, change in enumerate(
        [dict(action=Decision.IDLE), dict(belief=[0.25, 0.750002]), dict(fallback_used=True)]
    ):
        path = written(tmp_path / str(number), log(messages(**change)))
        assert digest(path) != plain


def test_the_hash_is_the_one_of_the_file(tmp_path):
    path = written(tmp_path / "events.csv", log(messages()))
    expected = hashlib.sha256(path.read_bytes()).hexdigest()
    assert digest_line(tmp_path) == f"event log {expected}"
    assert path.read_text().splitlines()[0] == ",".join(LOG_COLUMNS)


def test_the_log_of_another_run_is_refused(tmp_path):
    written(tmp_path / "events.csv", [])
    with pytest.raises(FileExistsError, match="events.csv holds the results of another run"):
        EventLogWriter(tmp_path / "events.csv")
