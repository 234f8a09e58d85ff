# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the cell: MuJoCo renders, models of the cameras spoil.

    renderer = CellRenderer(geometry, links, parameters, seed=1)
    frame = renderer.render(scene)      # in the thread that made the renderer, no other
    rgb, depth = renderer.render_cell(scene)    # one camera's part: the same pictures
    renderer.close()

One renderer at a time in a process. Needs no screen: EGL renders on the processor.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("MUJOCO_GL", "egl")  # read when mujoco is imported

import mujoco
import numpy as np

from fabric_dobot_driver import Links, load_limits
from fabric_sim.camera.lens import ColourLens, DepthSensor
from fabric_sim.camera.looks import Appearance
from fabric_sim.camera.mjcf import CUBES, FAR, FLOOR, NEAR, model_of
from fabric_sim.camera.parameters import CameraParameters, Lens
from fabric_sim.camera.posture import posture_of
from fabric_sim.camera.scene import Scene
from fabric_sim.camera.smear import hand_smear, head_smear
from fabric_sim.character import named_generator
from fabric_sim.geometry import CellGeometry, load_geometry

HIDDEN = (0.0, 0.0, FLOOR - 1.0)  # m
MOST_GEOMS = 600


class Frame(NamedTuple):
    """What the cameras saw. rgb: (H, W, 3) uint8, blue first. depth: (H, W) float32, m along the
    optical axis, NaN where there is none. head: (H, W, 3) uint8, blue first."""

    rgb: np.ndarray
    depth: np.ndarray
    head: np.ndarray


class CellRenderer:
    """Renders scenes of one run. Not thread-safe: OpenGL belongs to the thread that made it."""

    def __init__(
        self,
        geometry: CellGeometry,
        links: Links,
        parameters: CameraParameters,
        seed: int,
        shadows: bool = False,
    ) -> None:
        """links: of the arm. seed: root seed of the run; decides looks and noise. shadows: of the
        lamp, several times slower. Raises ValueError for a marker that does not exist."""
        self._parameters = parameters
        look = Appearance.draw(parameters.looks, geometry, seed)
        text = model_of(geometry, links, parameters, look, shadows)
        self._model = mujoco.MjModel.from_xml_string(text.xml, text.assets)
        self._data = mujoco.MjData(self._model)
        self._look, self._scenarios = look, tuple(geometry.scenarios)
        self._mocaps = self._find_mocaps()
        self._geometry = geometry
        self._gl = mujoco.GLContext(*self._largest())
        self._gl.make_current()
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._view = mujoco.MjvScene(self._model, maxgeom=MOST_GEOMS)
        self._view.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._option = mujoco.MjvOption()
        rngs = (named_generator(seed, name) for name in ("cell lens", "head lens", "depth"))
        cell, head, depth = rngs
        self._cell_lens = ColourLens(parameters.cell, parameters.grain, look.exposure, cell)
        self._head_lens = ColourLens(parameters.head, parameters.grain, look.exposure, head)
        self._cell_before: Scene | None = None
        self._head_before: Scene | None = None
        self._depth = DepthSensor(parameters.cell, parameters.depth, depth)

    @classmethod
    def of_files(
        cls,
        cell: str | Path,
        limits: str | Path,
        parameters: CameraParameters,
        seed: int,
        shadows: bool = False,
    ) -> CellRenderer:
        """Return the renderer of the cell in cell.yaml with the arm in magician.yaml.

        Raises ValueError naming the file, the entry and its value.
        """
        links = load_limits(limits).links
        return cls(load_geometry(cell), links, parameters, seed, shadows)

    def render(self, scene: Scene) -> Frame:
        """Return what the cameras see of a scene, noise and all.

        Raises ValueError for a scenario that is not known or more cubes than can be shown.
        """
        return Frame(*self.render_cell(scene), *self.render_head(scene))

    def render_cell(self, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
        """Return colour and depth of the camera over the cell; shapes as in Frame."""
        self._put(scene)
        lens, shutter = self._parameters.cell, self._parameters.grain.shutter
        rgb, depth = self._take("cell", lens), self._take_depth(lens)
        before, self._cell_before = self._cell_before, scene
        smear = hand_smear(lens, before, scene, shutter)
        return self._cell_lens.spoil(rgb, smear), self._depth.spoil(depth)

    def render_head(self, scene: Scene) -> tuple[np.ndarray]:
        """Return the one picture of the camera that looks at the helmet; its shape is in Frame."""
        self._put(scene)
        lens, shutter = self._parameters.head, self._parameters.grain.shutter
        head = self._take("head", lens)
        before, self._head_before = self._head_before, scene
        return (self._head_lens.spoil(head, head_smear(lens, before, scene, shutter)),)

    def render_clean(self, scene: Scene) -> Frame:
        """Return what perfect cameras would see; raises as `render`."""
        self._put(scene)
        cell, head = self._parameters.cell, self._parameters.head
        return Frame(self._take("cell", cell), self._take_depth(cell), self._take("head", head))

    def close(self) -> None:
        """Give back the graphics memory."""
        self._context.free()
        self._gl.free()

    # -- inside ---------------------------------------------------------------------------------

    def _largest(self) -> tuple[int, int]:
        lenses = (self._parameters.cell, self._parameters.head)
        return max(lens.width for lens in lenses), max(lens.height for lens in lenses)

    def _find_mocaps(self) -> dict[str, int]:
        """Rows of `mocap_pos` by the names of the bodies."""
        model = self._model
        ids = [(i, model.body_mocapid[i]) for i in range(model.nbody)]
        return {model.body(i).name: int(row) for i, row in ids if row >= 0}

    def _put(self, scene: Scene) -> None:
        """Bring every body to where the scene says."""
        if scene.scenario not in self._scenarios:
            known = ", ".join(self._scenarios)
            raise ValueError(f"scenario is {scene.scenario!r}; allowed: {known}")
        if len(scene.cubes) > CUBES:
            raise ValueError(f"{len(scene.cubes)} cubes are too many: {CUBES} can be shown")
        data = self._data
        for name in self._scenarios:
            here = name == scene.scenario
            data.mocap_pos[self._mocaps[f"trays_{name}"]] = (0.0, 0.0, 0.0) if here else HIDDEN
        for name, (place, quaternion) in posture_of(scene, self._geometry).items():
            row = self._mocaps[name]
            data.mocap_pos[row] = HIDDEN if place is None else place
            data.mocap_quat[row] = quaternion
        self._put_cubes(scene)
        j1, j2, j3, j4 = scene.joints
        data.qpos[:] = (j1, j2, -j2, j3, -j3, j4)
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)

    def _put_cubes(self, scene: Scene) -> None:
        for i in range(CUBES):
            row = self._mocaps[f"cube{i}"]
            if i >= len(scene.cubes):
                self._data.mocap_pos[row] = HIDDEN
                continue
            cube = scene.cubes[i]
            self._data.mocap_pos[row] = cube.position
            half = cube.yaw / 2.0
            self._data.mocap_quat[row] = (np.cos(half), 0.0, 0.0, np.sin(half))
            self._model.geom_rgba[self._model.geom(f"cube{i}").id, :3] = self._look.cubes[
                cube.colour
            ]

    def _take(self, name: str, lens: Lens) -> np.ndarray:
        """Colour (H, W, 3), blue first, of one camera."""
        self._gl.make_current()
        camera = mujoco.MjvCamera()
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        camera.fixedcamid = self._model.camera(name).id
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, camera, everything, self._view
        )
        window = mujoco.MjrRect(0, 0, lens.width, lens.height)
        rgb = np.empty((lens.height, lens.width, 3), np.uint8)
        mujoco.mjr_render(window, self._view, self._context)
        mujoco.mjr_readPixels(rgb, None, window, self._context)
        return np.ascontiguousarray(rgb[::-1, :, ::-1])

    def _take_depth(self, lens: Lens) -> np.ndarray:
        """Depth (H, W) in m of what was rendered last."""
        raw = np.empty((lens.height, lens.width), np.float32)
        window = mujoco.MjrRect(0, 0, lens.width, lens.height)
        mujoco.mjr_readPixels(None, raw, window, self._context)
        return NEAR / (1.0 - raw[::-1] * (1.0 - NEAR / FAR))
