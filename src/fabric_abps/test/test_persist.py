# SPDX-License-Identifier: BSD-3-Clause
"""A person is remembered under their code, exactly; files that do not fit are left alone."""

import json

import pytest
from conftest import TYPES, run_job
from test_selector import live_with

from fabric_abps import (
    Memory,
    MemoryFileError,
    Selector,
    SelectorParameters,
    TrainedModels,
    fingerprint,
    train,
)


@pytest.fixture
def models(library) -> TrainedModels:
    return train(library, TYPES, run_job, tasks=20, seed=11)


@pytest.fixture
def memory(tmp_path) -> Memory:
    return Memory(tmp_path / "people", "P07", "tiny", "abc")


@pytest.fixture
def known(library, models) -> Selector:
    selector = Selector(library, models, SelectorParameters(change_rate=0.02))
    live_with(selector, "touchy", 5)
    return selector


def test_who_comes_back_is_believed_to_be_exactly_who_they_were(
    library, models, known, memory
) -> None:
    memory.save(known)
    again = Selector(library, models, known.parameters)
    assert memory.load(again)
    assert (again.belief.log_probability == known.belief.log_probability).all()
    assert again.state() == known.state()
    for task_id in range(6, 12):
        one, other = (live_with(s, "calm", 1, first=task_id) for s in (known, again))
        assert one == other
        assert again.state() == known.state()
        assert again.typicality == known.typicality


def test_a_person_without_a_file_is_new(library, models, memory) -> None:
    selector = Selector(library, models)
    assert not memory.load(selector)
    assert selector.tasks_seen == 0
    assert not memory.path.exists()


def test_saving_replaces_the_file_as_a_whole(known, memory) -> None:
    memory.save(known)
    known.reset()
    memory.save(known)
    assert json.loads(memory.path.read_text())["state"]["tasks_seen"] == 0
    assert [path.name for path in memory.path.parent.iterdir()] == ["P07_tiny.json"]


def test_what_a_bandit_learnt_is_kept_and_lost_on_another_criterion(
    library, models, memory
) -> None:
    bandit = Selector(library, models, SelectorParameters(criterion="exp4"))
    for task_id in range(1, 5):
        bandit.select(task_id, 0)
        bandit.end_task(utility=3.0)
    memory.save(bandit)
    again = Selector(library, models, bandit.parameters)
    memory.load(again)
    assert again.state()["criterion_memory"] == bandit.state()["criterion_memory"] != []
    greedy = Selector(library, models, SelectorParameters(criterion="greedy"))
    assert memory.load(greedy)


def _edit(memory: Memory, **changes) -> None:
    document = json.loads(memory.path.read_text())
    state = changes.pop("state", {})
    document |= changes
    document["state"] |= state
    memory.path.write_text(json.dumps(document))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"models": "other"}, "models is 'other', expected 'abc'"),
        ({"person": "P08"}, "person is 'P08'"),
        ({"scenario": "sorting"}, "scenario is 'sorting'"),
        ({"format": 99}, "format is 99"),
        ({"state": {"types": ["calm"]}}, "types: are not those"),
        ({"state": {"log_belief": [0.0, 0.0, 0.0]}}, "belief sums to 3"),
        ({"state": {"log_belief": [0.0]}}, "belief must be"),
        ({"state": {"log_belief": [None, 0, 0]}}, "belief must be"),
        ({"state": {"p_values": [[2.0, 0.5, 0.5]]}}, "p_values must be in"),
        ({"state": {"p_values": [[0.5, 0.5]]}}, "p_values must be rows of 3 numbers"),
        ({"state": {"p_values": 0.5}}, "p_values must be rows of 3 numbers"),
        ({"state": {"change": {}}}, "entry 'tasks' is missing|entry 'people' is missing"),
        ({"state": {"tasks_seen": "many"}}, "tasks_seen must be a whole number >= 0, got 'many'"),
        ({"state": {"tasks_seen": -1}}, "tasks_seen must be a whole number >= 0, got -1"),
        ({"state": {"tasks_seen": float("inf")}}, "tasks_seen .* got inf"),
        ({"state": {"log_belief": [10**400, 0, 0]}}, "too large"),
        ({"state": {"criterion_memory": [1.0]}}, "remembers nothing"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_and_nothing_changes(
    library, models, known, memory, changes, message
) -> None:
    memory.save(known)
    _edit(memory, **changes)
    kept = memory.path.read_bytes()
    selector = Selector(library, models, known.parameters)
    with pytest.raises(MemoryFileError, match=message) as caught:
        memory.load(selector)
    assert str(memory.path) in str(caught.value)
    assert memory.path.read_bytes() == kept
    assert selector.state() == Selector(library, models, known.parameters).state()


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[1]", b"\xff\xfe", b'{"format": NaN}', pytest.param(b"[" * 99999, id="deep")],
)
def test_a_damaged_file_is_refused_by_name(library, models, memory, content) -> None:
    memory.path.parent.mkdir()
    memory.path.write_bytes(content)
    with pytest.raises(MemoryFileError, match="P07_tiny.json"):
        memory.load(Selector(library, models))
    assert memory.path.read_bytes() == content


@pytest.mark.parametrize("person", ["", "../P07", "Ann Smith", "P" * 33, "-7", "P07\n"])
def test_a_person_goes_by_a_code(tmp_path, person) -> None:
    with pytest.raises(ValueError, match="is not a code"):
        Memory(tmp_path, person, "tiny", "abc")


def test_the_fingerprint_is_of_the_models_file(models, tmp_path) -> None:
    models.save(tmp_path / "one.npz")
    models.save(tmp_path / "two.npz")
    assert fingerprint(tmp_path / "one.npz") == fingerprint(tmp_path / "two.npz")
    (tmp_path / "two.npz").write_bytes(b"other")
    assert fingerprint(tmp_path / "one.npz") != fingerprint(tmp_path / "two.npz")
