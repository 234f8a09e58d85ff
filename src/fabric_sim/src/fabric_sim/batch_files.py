# SPDX-License-Identifier: BSD-3-Clause
"""Where the headless runner finds models and numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import rospkg
import yaml

import fabric_planner as fp
from fabric_abps import Library, Selector, SelectorParameters, TrainedModels
from fabric_sim.cell import CellConfig


@dataclass
class Files:
    """Where the packages keep their models and numbers."""

    share: Callable[[str], Path] = field(
        default_factory=lambda: lambda package: Path(rospkg.RosPack().get_path(package))
    )

    def cell(self) -> CellConfig:
        """Geometry, limits, arm and sensors."""
        sim = self.share("fabric_sim") / "config"
        return CellConfig.load(
            self.share("fabric_bringup") / "config/cell.yaml",
            self.share("fabric_dobot_driver") / "config/magician.yaml",
            sim / "arm.yaml",
            sim / "sensing.yaml",
        )

    def model(self, policy: str, scenario: str) -> Path:
        """The model file of a policy; a path stands for itself."""
        if policy.endswith((".pomdpx", ".pomdp")):
            return Path(policy)
        models = self.share("fabric_planner") / "models"
        return models / (f"{policy}.pomdpx" if policy == "none" else f"{scenario}_{policy}.pomdpx")

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

    def motion(self) -> Path:
        """Places and speeds of the robot's actions."""
        return self.share("fabric_planner") / "config/motion.yaml"

    def selector(self, scenario: str) -> Selector:
        """ABPS over the shipped library with its trained models."""
        package = self.share("fabric_abps")
        config = package / "config"
        library = Library.load(config / "library.yaml", scenario)
        models = TrainedModels.load(package / f"models/{scenario}.npz")
        values = yaml.safe_load((config / "selector.yaml").read_text(encoding="utf-8"))
        return Selector(library, models, SelectorParameters.load(values))
