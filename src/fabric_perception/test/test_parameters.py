# SPDX-License-Identifier: BSD-3-Clause
"""Parameters are refused by name, and the README tells their values."""

import math
from pathlib import Path

import pytest
import yaml

from fabric_msgs.settings import settings_from, settings_table
from fabric_perception.parameters import ObservationParameters

PACKAGE = Path(__file__).resolve().parents[1]


def test_what_is_not_given_keeps_its_default():
    assert settings_from(ObservationParameters, {"action_percepts": 3}).same_action_timeout == 3.0


@pytest.mark.parametrize(
    "values, message",
    [
        ({"time_out": 3.0}, "unknown parameter 'time_out'"),
        ({"same_action_timeout": math.nan}, "same_action_timeout is nan"),
        ({"same_action_timeout": -1.0}, "same_action_timeout is -1.0; it must lie in"),
        ({"action_threshold": "high"}, "action_threshold is 'high'"),
        ({"action_percepts": 2.5}, "action_percepts is 2.5; it must be of type int"),
        ({"head_percepts": True}, "head_percepts is True"),
    ],
)
def test_a_bad_parameter_is_refused_by_name(values, message):
    with pytest.raises(ValueError, match=message):
        settings_from(ObservationParameters, values)


def test_the_shipped_file_holds_the_defaults():
    shipped = yaml.safe_load((PACKAGE / "config" / "observation.yaml").read_text())
    assert settings_from(ObservationParameters, shipped) == ObservationParameters()


def test_the_readme_table_is_the_generated_one():
    assert settings_table(ObservationParameters) in (PACKAGE / "README.md").read_text()
