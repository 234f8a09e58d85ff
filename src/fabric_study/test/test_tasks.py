# SPDX-License-Identifier: BSD-3-Clause
"""Task definitions: the shipped ones are read, everything that cannot be meant is refused."""

from collections import Counter
from pathlib import Path

import pytest
import yaml

from fabric_msgs.msg import Cube
from fabric_study.strict_yaml import DefinitionError
from fabric_study.tasks import definition_names, load_definition, task_seed

GOOD = {
    "scenario": "sorting",
    "cubes": {"count": 3, "order": ["red", "green", "red"]},
    "rules": {"red": "red", "green": "blue"},
    "rules_display_time": 2.0,
    "t_max": 30.0,
    "belt_speed": 0.05,
    "success_needs": 2,
    "scores": {"person": 10, "robot": 4, "wrong": -6},
}


def write(folder: Path, text: str) -> str:
    path = folder / "task.yaml"
    path.write_text(text)
    return str(path)


def changed(place: str, value) -> str:
    """Return GOOD as text with one value replaced, or taken away when it is None."""
    content = yaml.safe_load(yaml.safe_dump(GOOD))
    *parents, key = place.split(".")
    section = content
    for parent in parents:
        section = section[parent]
    if value is None:
        del section[key]
    else:
        section[key] = value
    return yaml.safe_dump(content)


def test_the_shipped_definitions_are_read():
    assert definition_names() == [
        "inspection", "sorting", "type_1_colours", "type_2_sequence", "type_3_mixed",
        "type_4_memory", "type_5_stroop",
    ]  # fmt: skip
    inspection, sorting = load_definition("inspection"), load_definition("sorting")
    assert (inspection.count, inspection.t_max, inspection.success_needs) == (1, 52.0, 1)
    assert (sorting.count, sorting.success_needs, sorting.fails_at) == (10, 7, None)
    assert sorting.scores.person > sorting.scores.robot > 0 > sorting.scores.wrong


def test_a_definition_is_read_from_a_path(tmp_path):
    definition = load_definition(write(tmp_path, yaml.safe_dump(GOOD)))
    assert definition.name == "task"
    assert definition.cube_colours(5) == (Cube.COLOUR_RED, Cube.COLOUR_GREEN, Cube.COLOUR_RED)
    assert [(item.colour, item.label) for item in definition.rules.items] == [
        (Cube.COLOUR_RED, "red"),
        (Cube.COLOUR_GREEN, "blue"),
    ]
    assert definition.cube_rules(5) == (0, 1, 0)
    assert definition.load == 1.0


def test_a_random_order_depends_on_the_seed_alone_and_is_balanced():
    sorting = load_definition("sorting")
    assert sorting.cube_colours(1) == sorting.cube_colours(1)
    assert len({sorting.cube_colours(seed) for seed in range(20)}) > 15
    assert sorted(Counter(sorting.cube_colours(3)).values()) == [3, 3, 4]


def test_task_seeds_differ_and_are_repeatable():
    seeds = [task_seed(1, task) for task in range(1, 101)]
    assert len(set(seeds)) == 100
    assert seeds == [task_seed(1, task) for task in range(1, 101)]
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert task_seed(2, 1) != task_seed(1, 1)


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(DefinitionError, match="no task definition 'moon'.*inspection, sorting"):
        load_definition("moon")


@pytest.mark.parametrize(
    "place, value, message",
    [
        ("scenario", "moon", "scenario: is 'moon'; allowed are inspection, sorting"),
        ("scenario", "inspection", "cubes.count: is 3; an inspection task has one package"),
        ("cubes", 3, "cubes: must be a mapping, not 3"),
        ("cubes.count", 0, "cubes.count: is 0; it must lie in 1..100"),
        ("cubes.count", 4, "cubes.order: lists 3 cubes, but count is 4"),
        ("cubes.count", True, "cubes.count: must be a whole number, not True"),
        ("cubes.order", "shuffled", "cubes.order: is 'shuffled'"),
        ("cubes.order", ["red", "mauve", "red"], "cubes.order: cube 2 is 'mauve'"),
        ("cubes.order", ["red", "blue", "red"], "rules.blue: is missing, but a blue cube comes"),
        ("rules", {}, "rules: is empty"),
        ("rules.red", "inspected", "rules.red: cannot be satisfied"),
        ("rules.mauve", "red", "rules.mauve: is no colour"),
        ("t_max", float("nan"), "t_max: is nan; it must be finite"),
        ("t_max", float("inf"), "t_max: is inf; it must be finite"),
        ("t_max", -1.0, "t_max: is -1.0; it must lie in"),
        ("t_max", "long", "t_max: must be a number, not 'long'"),
        ("t_max", None, "t_max: is missing"),
        ("success_needs", 4, "success_needs: is 4; it must lie in 1..3"),
        ("fails_at", 9, "fails_at: is 9; it must lie in 1..3"),
        ("load", 3.1, "load: is 3.1; it must lie in 0..3"),
        ("load", float("nan"), "load: is nan; it must be finite"),
        ("load", "heavy", "load: must be a number, not 'heavy'"),
        ("scores.person", 1.5, "scores.person: must be a whole number"),
        ("scores.team", 1, "scores.team: is not known"),
        ("speed", 1.0, "speed: is not known"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_file_key_and_value(tmp_path, place, value, message):
    path = write(tmp_path, changed(place, value))
    with pytest.raises(DefinitionError) as caught:
        load_definition(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(path)


@pytest.mark.parametrize(
    "text, message",
    [
        ("scenario: sorting\nscenario: inspection\n", "'scenario' is given twice, in line 2"),
        ("scenario: [sorting\n", "line 2"),
        ("- sorting\n", "must be a mapping"),
        ("", "must be a mapping, not None"),
        ("? [a, b]\n: c\n", "unhashable"),
    ],
)
def test_a_file_that_is_no_clean_mapping_is_refused(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(DefinitionError) as caught:
        load_definition(path)
    assert message in str(caught.value)
    assert path in str(caught.value)


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(DefinitionError, match="nowhere.yaml: cannot be read"):
        load_definition(str(tmp_path / "nowhere.yaml"))
