# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the camera node: typed, checked, refused by their full name."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fabric_sim.cell_parameters import Reader

CAMERAS = ("cell", "head")


@dataclass(frozen=True)
class CameraNodeParameters:
    """What the node is started with; files by path."""

    camera: str  # which of CAMERAS it is
    seed: int  # root seed of the run
    cell_file: str  # cell.yaml
    limits_file: str  # magician.yaml
    camera_file: str  # camera.yaml
    poses_file: str  # cameras.yaml
    helmet_file: str  # helmet.yaml
    shadows: bool = False  # of the lamp; several times slower

    @classmethod
    def load(cls, values: Mapping[str, Any], node: str) -> "CameraNodeParameters":
        """Check the values given to the node of this full name. Raises ParameterError."""
        reader = Reader(values, node)
        files = ("cell_file", "limits_file", "camera_file", "poses_file", "helmet_file")
        parameters = cls(
            reader.word("camera", CAMERAS),
            reader.whole("seed"),
            *(reader.word(name) for name in files),
            shadows=reader.flag("shadows", cls.shadows),
        )
        reader.refuse_unknown(set(cls.__dataclass_fields__))
        return parameters
