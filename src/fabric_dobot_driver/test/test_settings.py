# SPDX-License-Identifier: BSD-3-Clause
"""Settings of the driver are refused by name; the README's table is made from them."""

import math
from pathlib import Path

import pytest
import yaml

from fabric_dobot_driver.settings import DriverSettings
from fabric_msgs.settings import settings_from, settings_table

PACKAGE = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"leese": 0.3}, "unknown parameter 'leese'; known are reply_timeout"),
        ({"lease": math.nan}, "lease is nan; it must be finite"),
        ({"lease": 60.0}, "lease is 60.0; it must lie in 0.1..5"),
        ({"tries": 2.5}, "tries is 2.5; it must be of type int"),
        ({"stepper": True}, "stepper is True; it must be of type int"),
        ({"pulses_per_mm": "282.9"}, "pulses_per_mm is '282.9'; it must be of type float"),
    ],
)
def test_a_bad_value_is_refused_by_name(values, words):
    with pytest.raises(ValueError, match="^") as refusal:
        settings_from(DriverSettings, values)
    assert words in str(refusal.value)


def test_the_shipped_file_is_good():
    values = yaml.safe_load((PACKAGE / "config" / "driver.yaml").read_text())
    assert settings_from(DriverSettings, values) == DriverSettings()


def test_the_readme_tells_every_setting():
    assert settings_table(DriverSettings) in (PACKAGE / "README.md").read_text()
