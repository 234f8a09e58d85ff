# SPDX-License-Identifier: BSD-3-Clause
"""Files named on the command line are refused before anything starts."""

import pytest

from fabric_abps import persist
from fabric_bringup import checks
from fabric_bringup.models import main
from fabric_study.tasks import definition_names, load_definition

ABPS = ["scenario:=inspection", "policy:=proactive,abps"]


def test_the_shipped_library_is_accepted():
    assert main([*ABPS, "library:=", "selector:="]) == 0


def test_a_selector_file_without_its_parameters_is_refused_by_name(tmp_path, capsys):
    path = tmp_path / "selector.yaml"
    path.write_text("criterion: greedy\n", encoding="utf-8")
    assert main([*ABPS, f"selector:={path}"]) == 2
    said = capsys.readouterr().err
    assert str(path) in said and "'fixed_policy' is missing" in said
    path.write_text("", encoding="utf-8")
    assert main([*ABPS, f"selector:={path}"]) == 2
    assert f"{path}: parameters must be a mapping" in capsys.readouterr().err
    path.write_text("criterion: [greedy\n", encoding="utf-8")
    assert main([*ABPS, f"selector:={path}"]) == 2
    assert f"{path}: while parsing" in capsys.readouterr().err


def test_a_folder_without_trained_models_is_refused_by_name(tmp_path, capsys):
    assert main([*ABPS, f"library:={tmp_path}"]) == 2
    assert str(tmp_path / "models.npz") in capsys.readouterr().err


@pytest.mark.parametrize("policy", ["proactive", "reactive,none"])
def test_a_bad_library_is_nobodys_business_without_abps(tmp_path, policy):
    assert main(["scenario:=inspection", f"policy:={policy}", f"library:={tmp_path}"]) == 0


def test_a_code_of_a_person_is_one_for_the_command_line_and_for_abps():
    assert checks.PERSON == persist.CODE  # arguments must not import what is not built yet


def test_the_tasks_known_at_the_command_line_are_those_that_are_there():
    assert sorted(checks.TASKS) == definition_names()
    assert all(load_definition(name).scenario == of for name, of in checks.TASKS.items())


def test_a_task_of_another_scenario_or_one_that_cannot_be_is_refused(tmp_path, capsys):
    path = tmp_path / "mine.yaml"
    assert main(["scenario:=sorting", "task:=type_2_sequence"]) == 0
    assert main(["scenario:=inspection", "task:=type_2_sequence"]) == 2
    assert "it wants scenario:=sorting" in capsys.readouterr().err
    path.write_text("scenario: sorting\n", encoding="utf-8")
    assert main(["scenario:=sorting", f"task:={path}"]) == 2
    assert f"task:={path} is refused: {path}: cubes: is missing" in capsys.readouterr().err
