# SPDX-License-Identifier: BSD-3-Clause
"""Loads the files named on the command line, so that a bad one is refused at once."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence


def check_policy(path: str) -> None:
    """Raises ValueError naming file and place if no decision agent can run this model."""
    import fabric_planner

    fabric_planner.DecisionAgent(path, fabric_planner.PlannerOptions())


def check_human(path: str) -> None:
    """Raises ValueError naming file and place if no simulated person can be made of this model."""
    from fabric_sim.staff import check_human

    check_human(path)


def check_selector(value: Mapping[str, str]) -> None:
    """Raises ValueError or OSError naming file and place if ABPS cannot choose with these words."""
    from fabric_sim.batch_files import Files

    Files().selector(value["scenario"], value.get("selector", ""), value.get("library", ""))


def check_task(value: Mapping[str, str]) -> None:
    """Raises ValueError naming file and place if the task cannot be given in this scenario."""
    from fabric_study.tasks import load_definition

    definition = load_definition(value["task"])
    if definition.scenario != value["scenario"]:
        raise ValueError(f"it wants scenario:={definition.scenario}")


CHECKS = {"policy": check_policy, "human": check_human}


def main(words: Sequence[str]) -> int:
    """Checks the files among `name:=value` words; exit 2 and the reason when one is refused."""
    for word in words:
        name, _, text = word.partition(":=")
        paths = text.split(",") if name == "policy" else [text]  # batch takes several policies
        for path in filter(os.path.isabs, paths if name in CHECKS else ()):
            try:
                CHECKS[name](path)
            except ValueError as error:
                print(f"fabric: {name}:={path} is refused: {error}", file=sys.stderr)
                return 2
    value = dict(word.split(":=", 1) for word in words)
    if value.get("task"):
        try:
            check_task(value)
        except ValueError as error:
            print(f"fabric: task:={value['task']} is refused: {error}", file=sys.stderr)
            return 2
    if "abps" in value.get("policy", "").split(","):
        try:
            check_selector(value)
        except (ValueError, OSError) as error:
            print(f"fabric: policy:=abps is refused: {error}", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
