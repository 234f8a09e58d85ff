# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of the cell, out of four files."""

from dataclasses import dataclass
from pathlib import Path

from fabric_dobot_driver import Limits, load_limits
from fabric_sim.arm import ArmParameters, load_arm
from fabric_sim.geometry import CellGeometry, load_geometry
from fabric_sim.sensing import DirectParameters, load_sensing


@dataclass(frozen=True)
class CellConfig:
    """Everything of the cell that is a number in a file."""

    geometry: CellGeometry
    arm: ArmParameters
    limits: Limits
    sensing: DirectParameters

    @classmethod
    def load(cls, cell: Path, limits: Path, arm: Path, sensing: Path) -> "CellConfig":
        """Read launch/config/cell.yaml, the Dobot's magician.yaml, and this package's arm.yaml and
        sensing.yaml. Raises ValueError naming the file, the entry and its value."""
        return cls(load_geometry(cell), load_arm(arm), load_limits(limits), load_sensing(sensing))
