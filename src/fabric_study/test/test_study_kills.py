# SPDX-License-Identifier: BSD-3-Clause
"""Whatever is killed and whenever: no answer given and no event scored is lost or there twice."""

import os
import random
import signal
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from study_play import SEED, RunFolder, answer_of, play, small_protocol, small_study

from fabric_study.store import StoreError, read_records
from fabric_study.store_verify import verify
from fabric_study.study_data import load_study
from fabric_study.visit import Visit, begin_visit, people_of

KILLS = 20


def child(folder, pipe) -> None:
    """One life of the console with its task node and recorder: go on where the last one ended."""

    def report(*told) -> None:
        os.write(pipe, (repr(told) + "\n").encode())

    with small_study(folder) as study:
        people = people_of(study.store.records)
        unfinished = [code for code, (_, status) in people.items() if status == "open"]
        while len(people) < 4 or unfinished:
            rng = random.Random(f"codes/{len(people)}")
            visit = Visit(study, unfinished[0]) if unfinished else begin_visit(study, 1.0, rng)
            play(study, visit, RunFolder(study.new_run()), lambda *t, v=visit: report(v.person, *t))
            unfinished, people = [], people_of(study.store.records)


def life(folder, reports_to_live: int | None) -> tuple[list[tuple], int]:
    """Let a child play and kill it at a report; return its reports and the signal it died of."""
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        code = 1
        try:
            os.close(reading)
            child(folder, writing)
            code = 0
        finally:
            os._exit(code)
    os.close(writing)
    told = []
    with os.fdopen(reading) as pipe:
        for line in pipe:
            told.append(eval(line))  # noqa: S307 - what `child` wrote
            if len(told) == reports_to_live:
                os.kill(process, signal.SIGKILL)
    status = os.waitpid(process, 0)[1]
    if reports_to_live is None:
        assert os.waitstatus_to_exitcode(status) == 0
    return told, os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0


def test_a_study_killed_at_twenty_random_points_loses_nothing_and_doubles_nothing(tmp_path):
    rng = random.Random(101)
    protocol = small_protocol(tmp_path / "plan")
    folder = tmp_path / "study"
    told, killed = [], 0
    while killed < KILLS:
        reports, died_of = life(tmp_path, rng.randrange(1, 25))
        told += reports
        killed += died_of == signal.SIGKILL
        assert died_of == signal.SIGKILL, "the study was over before it was killed often enough"
        assert verify(folder).faults == []
    told += life(tmp_path, None)[0]
    records = read_records(folder)
    answers = Counter(
        (r.visit, r.content["step"], r.content["item"], repr(r.content["value"]))
        for r in records
        if r.kind == "answer" and r.content["value"] is not None
    )
    events = Counter(
        (r.content["run"], r.content["sequence"]) for r in records if r.kind == "task_event"
    )
    for person, what, *rest in told:
        if what == "answer":
            assert answers[person, rest[0], rest[1], repr(rest[2])] == 1
        elif what in ("scored", "event"):
            assert events[tuple(rest)] == 1
    assert max(answers.values()) == max(events.values()) == 1
    assert [status for _, status in people_of(records).values()] == ["finished"] * 4
    assert verify(folder).faults == []
    assert_answers_are_those_given(folder, protocol)


def assert_answers_are_those_given(folder, protocol) -> None:
    data = load_study(folder)
    instruments = protocol.instruments
    for (person, index), _ in data.people.groupby(["person", "index"]):
        steps = [s for s in protocol.visit_steps(index, SEED) if s.instrument]
        given = data.answers[data.answers["person"] == person]
        expected = [
            (s.instrument, item.id, answer_of(person, s.id, item))
            for s in steps
            for item in instruments[s.instrument].items
        ]
        columns = given[["instrument", "item", "value"]]
        assert list(columns.itertuples(index=False, name=None)) == expected


class Killed(BaseException):
    """Stands for SIGKILL in this process."""


class Killer:
    """Lets a store die at the n-th append, before or after it is on the disk."""

    def __init__(self, study, appends: int, after: bool) -> None:
        self._append, self._left, self._after = study.store.append, appends, after
        study.store.append = self

    def __call__(self, *entry) -> None:
        self._left -= 1
        if self._left < 0:
            if self._after:
                self._append(*entry)
            raise Killed
        self._append(*entry)


def final(study, code: str) -> tuple:
    data = load_study(study.folder)
    own = data.answers[data.answers["person"] == code].drop(columns="person")
    tasks = data.tasks[data.tasks["person"] == code][["condition", "number", "definition"]]
    return own.to_dict("records"), tasks.to_dict("records"), list(data.people["status"])


def play_killed(folder, lives: list[tuple[int, bool]]) -> tuple:
    """Play a visit of which the console dies again and again; return what the study knows then."""
    for number, (appends, after) in enumerate([*lives, (10**6, False)]):
        with small_study(folder) as study:
            if not number:
                Visit(study, "K7QF2M", 1.0, 0)
            Killer(study, appends, after)
            try:
                play(study, Visit(study, "K7QF2M"), RunFolder(study.new_run()))
            except Killed:
                continue
        break
    assert verify(folder / "study").faults == []
    return final(study, "K7QF2M")


@pytest.fixture(scope="module")
def never_killed(tmp_path_factory):
    return play_killed(tmp_path_factory.mktemp("whole"), [])


@settings(max_examples=10, deadline=None, database=None)
@given(lives=st.lists(st.tuples(st.integers(0, 40), st.booleans()), max_size=5))
def test_any_sequence_of_kills_and_resumes_yields_the_same_answers(
    tmp_path_factory, never_killed, lives
):
    assert play_killed(tmp_path_factory.mktemp("killed"), lives) == never_killed


def test_while_one_process_writes_another_is_refused_and_told_who_it_is(tmp_path):
    with small_study(tmp_path) as study:
        before = (study.folder / "study.sqlite").read_bytes()
        with pytest.raises(StoreError, match=f"written by console, process {os.getpid()} on "):
            small_study(tmp_path)
        assert (study.folder / "study.sqlite").read_bytes() == before
    small_study(tmp_path).close()
