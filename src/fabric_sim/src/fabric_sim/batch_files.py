# SPDX-License-Identifier: BSD-3-Clause
"""Where the headless runner finds models and numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import rospkg
import yaml

import fabric_planner as fp
from fabric_abps import Library, Selector, SelectorParameters, TrainedModels
from fabric_abps.library import MODELS
from fabric_sim.cell import CellConfig
from fabric_study.policies import model_path
from fabric_study.tasks import TaskDefinition, load_definition

SOLVER_WORK = 3e9  # multiplications that solving a model may take; about a second
SOLVER_TIME = 600.0  # s of CPU time; a guard, the work ends before
SOLVER_GAP = 0.01  # upper minus lower bound that is good enough
Kept = TypeVar("Kept")


@cache
def _share(package: str) -> Path:
    return Path(rospkg.RosPack().get_path(package))


@dataclass
class Files:
    """Where the packages keep their models and numbers; what many runs need is read once."""

    share: Callable[[str], Path] = _share
    _kept: dict[tuple[str, ...], Any] = field(default_factory=dict)

    def cell(self) -> CellConfig:
        """Geometry, limits, arm and sensors."""
        return self._once(self._read_cell, "cell")

    def definition(self, scenario: str, task: str = "") -> TaskDefinition:
        """The task definition of a name or a .yaml file, else the one named like the scenario.

        Raises ValueError when it is one of another scenario.
        """
        name = task or scenario
        found = self._once(lambda: load_definition(name), "definition", name)
        if task and found.scenario != scenario:
            raise ValueError(f"task {task} is of scenario {found.scenario}, not {scenario}")
        return found

    def motion(self) -> fp.MotionConfig:
        """Places and speeds of the robot's actions."""
        path = self.share("fabric_planner") / "config/motion.yaml"
        return self._once(lambda: fp.MotionConfig.load(str(path)), "motion")

    def _once(self, read: Callable[[], Kept], *key: str) -> Kept:
        if key not in self._kept:
            self._kept[key] = read()
        return self._kept[key]

    def _read_cell(self) -> CellConfig:
        sim = self.share("fabric_sim") / "config"
        return CellConfig.load(
            self.share("fabric_bringup") / "config/cell.yaml",
            self.share("fabric_dobot_driver") / "config/magician.yaml",
            sim / "arm.yaml",
            sim / "sensing.yaml",
        )

    def model(self, policy: str, scenario: str) -> Path:
        """The model file of a policy. Raises ValueError when there is none."""
        return model_path(policy, scenario, self.share("fabric_planner") / "models")

    def solve(self, policy: str, scenario: str) -> fp.AlphaVectors:
        """Solve a policy's model beforehand; equal on every machine."""
        model = fp.load(self.model(policy, scenario))
        return fp.solve(model, time=SOLVER_TIME, gap=SOLVER_GAP, work=SOLVER_WORK).lower

    def offline_agent(self, model: Path, solved: fp.AlphaVectors) -> fp.DecisionAgent:
        """What decides without a search, by a model that was solved beforehand."""
        limits = fp.PlannerOptions(max_nodes=1, preparation=fp.Preparation.QUICK)
        return fp.DecisionAgent(str(model), limits, solver="offline", policy=solved)

    def agent(self, model: Path) -> fp.DecisionAgent:
        """What decides, set up as the decision node is."""
        path = self.share("fabric_planner") / "config/decision.yaml"
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
        policy = fp.load_policy(values["policy"], fp.load(model)) if values["policy"] else None
        return fp.DecisionAgent(
            str(model),
            fp.PlannerOptions(values["deadline"], values["gap"], values["max_nodes"]),
            map_path=values["observation_map"],
            solver=values["solver"],
            policy=policy,
            fallback=values["fallback_action"],
        )

    def selector(self, scenario: str, parameters: str = "", library: str = "") -> Selector:
        """ABPS over a library with its trained models. parameters, library: file and folder in
        place of the shipped ones. Raises ValueError naming what is wrong with them, OSError
        without the file of parameters.
        """
        package = self.share("fabric_abps")
        folder = Path(library) if library else package / "library" / scenario
        path = Path(parameters) if parameters else package / "config/selector.yaml"
        try:
            values = SelectorParameters.load(yaml.safe_load(path.read_text(encoding="utf-8")))
        except (ValueError, yaml.YAMLError) as error:
            raise ValueError(f"{path}: {error}") from error
        models = TrainedModels.load(folder / MODELS)
        return Selector(Library.load(folder, scenario), models, values)
