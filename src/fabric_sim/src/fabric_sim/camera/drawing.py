# SPDX-License-Identifier: BSD-3-Clause
"""A renderer, or the reason why this machine has none."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fabric_sim.camera.parameters import CameraParameters

if TYPE_CHECKING:
    from fabric_sim.camera.renderer import CellRenderer


class CannotDraw(RuntimeError):
    """No picture can be made on this machine; the message says why and what helps."""


def open_renderer(
    cell: Path, limits: Path, parameters: CameraParameters, seed: int
) -> CellRenderer:
    """Return CellRenderer.of_files(...). Raises ValueError as it does, CannotDraw without MuJoCo or
    EGL. The graphics begin with this call, not with an import: they belong to one process."""
    try:
        from fabric_sim.camera.renderer import CellRenderer

        return CellRenderer.of_files(cell, limits, parameters, seed)
    except ValueError:
        raise
    except Exception as error:  # MuJoCo, OpenGL and EGL fail in many ways
        raise CannotDraw(
            f"sensing:=camera cannot draw the cell: {type(error).__name__}: {error}; it needs the "
            "Python package mujoco and EGL (Debian: libegl1, libgl1-mesa-dri; MUJOCO_GL=egl); "
            "sensing:=direct needs neither"
        ) from error
