# SPDX-License-Identifier: BSD-3-Clause
"""Protocols: the shipped ones are those of the thesis, orders balance, mistakes are named."""

import copy
import re
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from study_play import INSTRUMENTS, PLAN, likert, small_protocol, words, write_plan

from fabric_study.orders import ORDERS, condition_order, williams_rows
from fabric_study.protocol import load_protocol, protocol_from, protocol_names
from fabric_study.shipped import load_path
from fabric_study.strict_yaml import DefinitionError

SEEDS = st.integers(0, 2**31 - 1)


def tasks_of(protocol, index=0, seed=101):
    return [s for s in protocol.visit_steps(index, seed) if s.kind == "task" and not s.practice]


def test_three_protocols_are_shipped():
    assert protocol_names() == ["experiment-0", "experiment-1", "experiment-2"]


def test_experiment_1_is_one_task_alone_and_three_with_each_robot_on_one_type_of_task():
    protocol = load_protocol("experiment-1")
    assert protocol.people == 14
    for index in range(14):
        tasks = tasks_of(protocol, index)
        assert [task.number for task in tasks] == [1, 2, 3, 4, 5, 6, 7]
        assert tasks[0].condition == "alone"
        assert Counter((t.condition, t.policy, t.definition) for t in tasks) == {
            ("alone", "none", "type_4_memory"): 1,
            ("reactive", "reactive", "type_4_memory"): 3,
            ("proactive", "proactive", "type_4_memory"): 3,
        }
        assert len({task.condition for task in tasks[1:4]}) == 1


@settings(deadline=None)
@given(SEEDS)
def test_seven_of_fourteen_people_meet_the_reactive_robot_first(seed):
    protocol = load_experiment_1()
    second = [protocol.condition_order(index, seed)[1] for index in range(14)]
    assert Counter(second) == {"reactive": 7, "proactive": 7}


def load_experiment_1(kept=[]):  # noqa: B006 - read once
    if not kept:
        kept.append(load_protocol("experiment-1"))
    return kept[0]


def test_experiment_1_asks_after_each_task_after_each_robot_and_compares_once_at_the_end():
    steps = load_protocol("experiment-1").visit_steps(3, 101)
    asked = Counter(step.instrument for step in steps if step.instrument)
    assert asked == {
        "demographics": 1, "experiment_1_alone": 1, "experiment_1_task": 6,
        "experiment_1_general": 2, "experiment_1_comparison": 1, "remarks": 1,
    }  # fmt: skip
    for before, step in zip(steps, steps[1:], strict=False):
        if step.instrument == "experiment_1_task":
            assert before.kind == "task"
            assert (before.condition, before.number) == (step.condition, step.number)
    assert [s.condition for s in steps if s.instrument == "experiment_1_comparison"] == [""]


def test_people_of_experiment_1_never_read_which_robot_is_which():
    protocol = load_protocol("experiment-1")
    texts = [step.text for step in protocol.visit_steps(0, 101)]
    texts += [condition.shown_as for condition in protocol.conditions.values()]
    for instrument in protocol.instruments.values():
        texts += [text for item in instrument.items for text in (item.text, *item.labels.values())]
    for text in texts:
        for spoken in text.values():
            assert not re.search("rea[ck]tiv|proa[ck]tiv", spoken.lower())


def test_experiment_0_is_three_types_three_times_in_a_changing_order_with_the_load_index():
    protocol = load_protocol("experiment-0")
    orders = set()
    for index in range(12):
        tasks = tasks_of(protocol, index)
        orders.add(tuple(task.condition for task in tasks))
        definitions = {(task.condition, task.definition) for task in tasks}
        assert definitions == {
            ("type_1", "type_1_colours"), ("type_2", "type_2_sequence"),
            ("type_4", "type_4_memory"),
        }  # fmt: skip
        assert Counter(task.condition for task in tasks) == dict.fromkeys(protocol.conditions, 3)
        assert [t.in_condition for t in tasks if t.condition == "type_2"] == [1, 2, 3]
        steps = protocol.visit_steps(index, 101)
        assert sum(step.instrument == "nasa_tlx" for step in steps) == 9
        assert sum(step.instrument == "gestures" for step in steps) == 1
    assert len(orders) > 1


def test_experiment_2_is_eight_tasks_of_the_words_in_colours_with_chosen_policies():
    tasks = tasks_of(load_protocol("experiment-2"))
    assert [(t.condition, t.definition, t.policy) for t in tasks] == [
        ("abps", "type_5_stroop", "abps")
    ] * 8


@pytest.mark.parametrize("name", protocol_names())
def test_every_step_has_an_id_of_its_own_and_the_content_reads_back_the_same(name):
    protocol = load_protocol(name)
    ids = [step.id for step in protocol.visit_steps(5, 101)]
    assert len(set(ids)) == len(ids)
    again = protocol_from(protocol.content, "study.json")
    assert (again, again.hash) == (protocol, protocol.hash)


def test_the_hash_tells_of_any_wording_and_of_the_order_of_items(tmp_path):
    first = small_protocol(tmp_path / "a").hash
    assert small_protocol(tmp_path / "b").hash == first
    after = INSTRUMENTS["after"]
    turned = {**after, "items": dict(reversed(after["items"].items()))}
    for number, other in enumerate([turned, {**after, "title": words("Other")}]):
        path = write_plan(tmp_path / str(number), PLAN, {**INSTRUMENTS, "after": other})
        assert load_protocol(str(path)).hash != first


@pytest.mark.parametrize("n", range(1, 8))
def test_a_latin_square_is_balanced_for_places_and_for_what_comes_before(n):
    rows = williams_rows(n)
    for place in range(n):
        assert set(Counter(row[place] for row in rows).values()) == {len(rows) // n}
    pairs = Counter(pair for row in rows for pair in zip(row, row[1:], strict=False))
    assert len(pairs) == n * (n - 1)
    assert len(set(pairs.values())) <= 1


@settings(deadline=None)
@given(st.sampled_from(ORDERS), st.integers(1, 4), SEEDS)
def test_every_order_holds_each_condition_once_and_blocks_use_up_all_orders(kind, n, seed):
    names = [f"c{i}" for i in range(n)]
    orders = [condition_order(kind, names, place, seed) for place in range(48)]
    assert all(sorted(order) == names for order in orders)
    assert orders == [condition_order(kind, names, place, seed) for place in range(48)]
    if kind in ("latin_square", "balanced"):
        assert len(set(Counter(orders).values())) == 1  # 48 is whole blocks for each n


def test_task_seeds_differ_between_people_steps_and_studies():
    protocol = load_protocol("experiment-1")
    seeds = {
        protocol.task_seed(index, seed, f"task_{number}")
        for index in range(5)
        for seed in (101, 102)
        for number in range(1, 8)
    }
    assert len(seeds) == 70
    assert all(0 <= seed < 2**31 for seed in seeds)


def changed(*path, value=None, drop=False):
    plan = copy.deepcopy(PLAN)
    place = plan
    for key in path[:-1]:
        place = place[key]
    if drop:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return plan


SIX = {f"c{i}": PLAN["conditions"]["quick"] for i in range(6)}
REFUSED = [
    (changed("colour", value=1), "colour: is not known"),
    (changed("people", value=0), "people: is 0; it must lie in 1..10000"),
    (changed("people", value=2.5), "people: must be a whole number"),
    (changed("title", "de", drop=True), "title.de: is missing"),
    (changed("rounds", value=0), "rounds: is 0"),
    (changed("order", "kind", value="any"), "order.kind: is 'any'; allowed are fixed"),
    (changed("order", "first", value=["nobody"]), "order.first: 'nobody' is given twice, or"),
    (changed("order", "first", value=["slow", "slow"]), "order.first: 'slow' is given twice, or"),
    (changed("order", "first", value="slow"), "order.first: must be a list"),
    (changed("order", "seed", value=3), "order.seed: is not known"),
    (changed("conditions", value={}), "conditions: is empty"),
    (changed("conditions", "Slow", value={}), "conditions.Slow: is no name"),
    (changed("conditions", "slow", "tasks", value=0), "conditions.slow.tasks: is 0"),
    (changed("conditions", "slow", "policy", value="lazy"), "conditions.slow.policy: is 'lazy'"),
    (changed("conditions", "slow", "policy", value="own.pomdpx"),
     "conditions.slow.policy: own.pomdpx must be a full path"),
    (changed("conditions", "slow", "policy", value="/nowhere/own.pomdpx"),
     "conditions: there is no model file /nowhere/own.pomdpx"),
    (changed("conditions", "slow", "policy", drop=True), "conditions.slow.policy: is missing"),
    (changed("conditions", "slow", "robot", value=1), "conditions.slow.robot: is not known"),
    (changed("conditions", "slow", "shown_as", drop=True), "conditions.slow.shown_as: is missing"),
    (changed("conditions", "slow", "definition", value="type_9"), "no task definition 'type_9'"),
    (changed("conditions", "slow", "definition", value="own.yaml"),
     "conditions.slow.definition: own.yaml must be a full path"),
    (changed("conditions", "slow", "definition", value=9), "conditions.slow.definition: must name"),
    (changed("conditions", "slow", "after_task", value=["load"]),
     "conditions.slow.after_task: load is meant for `when: general`, not for after_task"),
    (changed("after_condition", value=["after"]), "after_condition: after is meant for `when: ta"),
    (changed("after_task", value=["after", "after"]), "after_task: after is given twice"),
    (changed("after_task", value="after"), "after_task: must be a list of instruments"),
    (changed("after_task", value=[7]), "after_task: no instrument 7"),
    (changed("after_task", drop=True), "after_task: is missing"),
    (changed("start", value={}), "start: must be a list"),
    (changed("start", 0, value="Hello"), "start.1: must be a mapping"),
    (changed("start", 0, value={}), "start.1: must be one of text, instrument"),
    (changed("start", 0, value={"text": words("a"), "instrument": "demographics"}),
     "start.1: must be one of text, instrument"),
    (changed("start", 0, "text", "en", drop=True), "start.1.text.en: is missing"),
    (changed("start", 0, value={"instrument": "demographics"}), "start.2.instrument: demographics"),
    (changed("start", 1, "instrument", value="load"), "start.2.instrument: load is meant for"),
    (changed("start", 2, "practice", "policy", value="x"), "start.3.practice.policy: is 'x'"),
    (changed("start", 2, "practice", "tasks", value=2), "start.3.practice.tasks: is not known"),
    (changed("end", 0, value=PLAN["start"][2]), "end.1: must be one of text, instrument"),
    ({**PLAN, "conditions": SIX, "order": {"kind": "balanced"}}, "order.kind: balanced over 6"),
]  # fmt: skip


@pytest.mark.parametrize("plan, complaint", REFUSED, ids=[text for _, text in REFUSED])
def test_what_cannot_be_meant_is_refused_with_file_and_key(tmp_path, plan, complaint):
    path = write_plan(tmp_path, plan)
    with pytest.raises(DefinitionError) as refused:
        load_protocol(str(path))
    assert str(refused.value).startswith(f"{path}: {complaint}")


def test_an_instrument_that_cannot_be_read_is_refused_with_its_own_file(tmp_path):
    odd = {**INSTRUMENTS["after"], "items": {"calm": {**likert("calm"), "kind": "slider"}}}
    path = write_plan(tmp_path, PLAN, {**INSTRUMENTS, "after": odd})
    with pytest.raises(DefinitionError, match=r"after.yaml: items.calm.kind: is 'slider'"):
        load_protocol(str(path))


def test_an_instrument_that_is_nowhere_is_refused_with_the_shipped_ones(tmp_path):
    plan = changed("after_task", value=["mood"])
    with pytest.raises(DefinitionError, match="no 'mood' among the instruments; there are"):
        load_protocol(str(write_plan(tmp_path, plan)))


def test_definitions_are_of_one_scenario(tmp_path):
    plan = changed("conditions", "slow", "definition", value="inspection")
    with pytest.raises(DefinitionError, match="conditions: mix the scenarios inspection, sorting"):
        load_protocol(str(write_plan(tmp_path, plan)))


def test_a_task_that_was_made_harder_is_another_protocol(tmp_path):
    text = load_path("tasks", "sorting").read_text(encoding="utf-8")
    hashes = set()
    for seconds in ("8.0", "2.0"):
        own = tmp_path / "own.yaml"
        own.write_text(text.replace("rules_display_time: 8.0", f"rules_display_time: {seconds}"))
        plan = changed("conditions", "slow", "definition", value=str(own))
        hashes.add(load_protocol(str(write_plan(tmp_path, plan))).hash)
    assert len(hashes) == 2


def test_content_whose_definitions_are_not_those_of_the_plan_is_refused(tmp_path):
    content = small_protocol(tmp_path).content
    other = {"type_9": {}}
    with pytest.raises(DefinitionError, match="definitions.sorting: is missing"):
        protocol_from({**content, "definitions": other}, "study.json")
    with pytest.raises(DefinitionError, match="definitions.type_9: is not known"):
        both = {**content["definitions"], **other}
        protocol_from({**content, "definitions": both}, "study.json")


def test_a_decision_model_of_ones_own_can_be_a_condition(tmp_path):
    model = tmp_path / "own.pomdpx"
    model.touch()
    plan = changed("conditions", "slow", "policy", value=str(model))
    protocol = load_protocol(str(write_plan(tmp_path, plan)))
    assert protocol.conditions["slow"].policy == str(model)
    model.unlink()
    assert protocol_from(protocol.content, "study.json") == protocol  # read on another machine
