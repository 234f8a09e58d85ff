# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the cell node are refused by their full names."""

import math

import pytest

from fabric_sim.cell_parameters import CellParameters, ParameterError

GOOD = {
    "human": "expert_rested_attentive_collaborative",
    "seed": 1,
    "sensing": "direct",
    "expected": "task motion",
    "cell_file": "cell.yaml",
    "limits_file": "magician.yaml",
    "arm_file": "arm.yaml",
    "sensing_file": "sensing.yaml",
}


def test_defaults_and_lists():
    parameters = CellParameters.load(GOOD | {"speed": 4}, "/cell")
    assert parameters.expected == ("task", "motion")
    assert (parameters.speed, parameters.guard) == (4.0, 20.0)
    assert CellParameters.load(GOOD | {"expected": ["task"]}, "/cell").expected == ("task",)


def test_somebody_at_the_keys_needs_a_speed():
    manual = GOOD | {"human": "manual"}
    assert CellParameters.load(manual, "/cell").speed == 1.0
    with pytest.raises(ParameterError, match="/cell/speed is 0, want more than 0 with human man"):
        CellParameters.load(manual | {"speed": 0.0}, "/cell")


@pytest.mark.parametrize("key", sorted(GOOD))
def test_what_changes_results_has_no_default(key):
    values = {k: v for k, v in GOOD.items() if k != key}
    with pytest.raises(ParameterError, match=f"^parameter /a/cell/{key} is missing$"):
        CellParameters.load(values, "/a/cell")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("sensing", "eyes", "is 'eyes', want one of direct, camera"),
        ("seed", -1, "is -1, want a whole number, 0 or more"),
        ("seed", "one", "is 'one', want a whole number"),
        ("speed", math.nan, "is nan, want a finite number, 0 or more"),
        ("speed", -1.0, "is -1.0, want a finite number, 0 or more"),
        ("guard", 0, "is 0, want a finite number, 0.1 or more"),
        ("expected", [1], "is [1], want a list of words"),
        ("human", "", "is '', want a word"),
        ("arm_frames", "yes", "is 'yes', want true or false"),
        ("colour", "red", "is not known"),
    ],
)
def test_bad_values_are_named(key, value, words):
    with pytest.raises(ParameterError) as caught:
        CellParameters.load(GOOD | {key: value}, "/cell")
    assert str(caught.value).startswith(f"parameter /cell/{key} ")
    assert words in str(caught.value)
