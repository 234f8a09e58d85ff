# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the simulated cameras share: shipped numbers, scenes, small cameras."""

from dataclasses import replace

from cell_helpers import CONFIG, SRC, B, G, R

from fabric_sim.camera.parameters import CameraParameters
from fabric_sim.camera.scene import Scene, SceneCube

CONFIGS = SRC / "fabric_sim" / "config"
HELMET = SRC / "fabric_perception" / "config" / "helmet.yaml"
PARAMETERS = CameraParameters.load(CONFIGS / "camera.yaml", CONFIGS / "cameras.yaml", HELMET)
GEOMETRY, LINKS = CONFIG.geometry, CONFIG.limits.links
BELT_CUBE = SceneCube(G, (0.281, -0.125, 0.1345), 0.0)  # by itself, on the belt
ASIDE = {"joints": (-1.4, 0.3, 0.4, 0.0)}  # the arm is out of the way
SCENES = {
    "work": Scene(cubes=(BELT_CUBE,), **ASIDE),
    "colours": Scene(
        cubes=tuple(
            SceneCube(colour, (0.281, y, 0.1345), 0.0)
            for colour, y in ((R, 0.05), (G, -0.05), (B, -0.15))
        ),
        **ASIDE,
    ),
    "away": Scene(
        scenario="inspection", hand=(1.7, -0.4, 0.0), shoulder=(1.9, -0.4, 0.36),
        head=(1.8, -0.6, 0.52), **ASIDE,
    ),
}  # fmt: skip


def small(width: int = 320) -> CameraParameters:
    """The shipped parameters with cameras of fewer pixels that see the same."""
    share = width / PARAMETERS.cell.width
    lenses = {
        name: getattr(PARAMETERS, name)._replace(
            width=width, height=width * 3 // 4, focal=share * getattr(PARAMETERS, name).focal
        )
        for name in ("cell", "head")
    }
    return replace(PARAMETERS, **lenses)
