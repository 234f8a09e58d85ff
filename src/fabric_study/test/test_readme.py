# SPDX-License-Identifier: BSD-3-Clause
"""The README names every column, and every key of the shipped definitions."""

from pathlib import Path

import yaml

from fabric_study.meter import COLUMNS
from fabric_study.tasks import definitions_folder

README = (Path(__file__).resolve().parents[1] / "README.md").read_text()


def test_every_column_is_explained():
    assert [column for column in COLUMNS if f"`{column}`" not in README] == []


def test_every_key_of_a_definition_is_explained():
    for path in definitions_folder().glob("*.yaml"):
        keys = yaml.safe_load(path.read_text())
        assert [key for key in keys if f"`{key}`" not in README] == []
