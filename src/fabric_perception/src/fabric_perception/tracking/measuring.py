# SPDX-License-Identifier: BSD-3-Clause
"""Stage 3: where in the cell a patch is, from the median of its valid depths."""

from typing import NamedTuple

import cv2
import numpy as np

from fabric_msgs.msg import Cube
from fabric_perception.camera import Camera
from fabric_perception.tracking.colours import CUBES
from fabric_perception.tracking.contours import Patch, patch_within
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.workspace import Workspace, ground_under

BORDER = np.ones((3, 3), np.uint8)
FEW = 5  # pixels with a depth, below which a median says nothing
ROUNDS = 6  # of the division of a patch into cubes
HIGHEST = 1.0  # m above the table, of anything that is worked with
INFERRED = 3.0  # times the noise, of a place without depth
SQUARE_IN_VIEW = 1.1  # squared edges that a cube shows on average


class Detection(NamedTuple):
    """A cube in one picture.

    colour: Cube.COLOUR_*. position: (3,) of its middle, m in cell. sigma: m, standard deviation
    of it along an axis. purity: share of its colour among the coloured pixels around it.
    """

    colour: int
    position: np.ndarray
    sigma: float
    purity: float
    patch: Patch


class Surface(NamedTuple):
    """What is known of the visible side of a patch: m; depth along the optical axis."""

    depth: float  # NaN when too few pixels have one
    height: float  # median of the upper four fifths of its points in the cell
    relief: float  # between the 20th and the 80th percentile of the heights


class Measuring:
    """Turns patches into places. The rays of a camera are worked out once."""

    def __init__(
        self, camera: Camera, workspace: Workspace, parameters: TrackingParameters
    ) -> None:
        self.camera, self.workspace, self._parameters = camera, workspace, parameters
        v, u = np.mgrid[0 : camera.height, 0 : camera.width]
        rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
        rise = rays @ camera.pose_in_cell[2, :3]
        self._rise = rise.reshape(camera.height, camera.width).astype(np.float32)
        self._origin = camera.position
        self._focal = float(np.sqrt(camera.K[0, 0] * camera.K[1, 1]))

    # -- cubes ----------------------------------------------------------------------------------

    def cubes(
        self, patches: list[Patch], depth: np.ndarray, masks: dict[str, np.ndarray]
    ) -> list[Detection]:
        """Return the cubes among patches; depth (H, W) m, masks as segmented."""
        whole: list[tuple[Patch, Surface]] = []
        for patch in patches:
            surface = self.surface(patch, depth)
            whole += self._single_cubes(patch, surface, depth)
        if not whole:
            return []
        rays = self._rays([patch for patch, _ in whole])
        found = [
            self._cube(patch, surface, ray, masks)
            for (patch, surface), ray in zip(whole, rays, strict=True)
        ]
        return _without_doubles([cube for cube in found if cube], self.workspace.edge)

    def _single_cubes(
        self, patch: Patch, surface: Surface, depth: np.ndarray
    ) -> list[tuple[Patch, Surface]]:
        """The patch, its parts when it shows several cubes, or nothing when it is no cube."""
        side = self._side(patch, surface)
        if side < self._parameters.cube_least:
            return []
        if side <= self._parameters.cube_most and not _is_long(patch, side):
            return [(patch, surface)]
        tray = self.workspace.tray_over(*self._ground(patch, surface)[:2], self.workspace.edge)
        if tray is None:
            return []
        count = max(2, round(side**2 / SQUARE_IN_VIEW))
        room = int(np.prod(tray.size) / self.workspace.edge**2)
        if count > room:
            return []
        return [(part, self.surface(part, depth)) for part in split(patch, count)]

    def _side(self, patch: Patch, surface: Surface) -> float:
        """Side of a square of the patch's area, in edges of a cube."""
        distance = surface.depth
        if np.isnan(distance):
            distance = float(self.camera.to_camera(self._ground(patch, surface)[None])[0, 2])
        return float(np.sqrt(patch.area)) * distance / self._focal / self.workspace.edge

    def _cube(
        self, patch: Patch, surface: Surface, ray: np.ndarray, masks: dict[str, np.ndarray]
    ) -> Detection | None:
        """The outline of a body as symmetric as a cube has the body's middle for its middle, so
        only the height along the ray through it is left to find."""
        sigma, top = self._parameters.cube_noise, surface.height
        if np.isnan(top):
            ground = self._ground(patch, surface)
            top = self.workspace.support(*ground[:2]) + self.workspace.edge
            sigma *= INFERRED
        position = self._middle(ray, top)
        edge = self.workspace.edge
        if not -edge < position[2] < HIGHEST:
            return None
        side = self._side(patch, surface)
        if side < 0.9:
            sigma *= 0.9 / side
        return Detection(CUBES[patch.colour], position, sigma, _purity(patch, masks), patch)

    def _middle(self, ray: np.ndarray, top: float) -> np.ndarray:
        """The middle (3,) of a cube whose upper side is at a height, seen along a ray.

        Of a cube that stands the foot is left out as ground; what remains is symmetric too.
        """
        edge, origin = self.workspace.edge, self._origin
        position = origin + ray * ((top - edge / 2 - origin[2]) / ray[2])
        if top - self.workspace.support(*position[:2]) < 1.4 * edge:
            seen = (edge - self._parameters.ground_margin) / 2
            position = origin + ray * ((top - seen - origin[2]) / ray[2])
            position[2] = top - edge / 2
        return position

    # -- anything -------------------------------------------------------------------------------

    def surface(self, patch: Patch, depth: np.ndarray) -> Surface:
        """Depth of a patch: of the valid pixels that are not at its border."""
        depths, rise = patch.window(depth), patch.window(self._rise)
        inner = cv2.erode(patch.inside, BORDER, borderValue=0)
        chosen = _valid(depths, inner)
        if np.count_nonzero(chosen) < max(FEW, self._parameters.depth_share * patch.area):
            chosen = _valid(depths, patch.inside)
        values = depths[chosen]
        if values.size < max(FEW, self._parameters.depth_share * patch.area):
            return Surface(np.nan, np.nan, 0.0)
        heights = np.sort(rise[chosen] * values)
        count = heights.size
        upper = float(heights[(3 * count) // 5]) + self._origin[2]
        relief = float(heights[(4 * count) // 5] - heights[count // 5])
        return Surface(float(np.partition(values, count // 2)[count // 2]), upper, relief)

    def place(self, patch: Patch, distance: float) -> np.ndarray:
        """The point (3,) m in the cell that the middle of a patch shows at a depth, m."""
        return self._origin + self._rays([patch])[0] * distance

    def size(self, patch: Patch, distance: float) -> tuple[float, float, float]:
        """Area in m^2, longer and shorter side in m, of a patch at a depth, m."""
        scale = distance / self._focal
        (_, sides, _) = cv2.minAreaRect(patch.contour)
        longer, shorter = max(sides) + 1.0, min(sides) + 1.0
        return patch.area * scale**2, longer * scale, shorter * scale

    def _rays(self, patches: list[Patch]) -> np.ndarray:
        """Directions (N, 3) in the cell, of length 1 along the optical axis."""
        return self.camera.rays([p.centre for p in patches]) @ self.camera.pose_in_cell[:3, :3].T

    def _ground(self, patch: Patch, surface: Surface) -> np.ndarray:
        """The point (3,) where a patch is, or would be if it were a cube on the ground."""
        if np.isnan(surface.depth):
            ray, above = self._rays([patch])[0], self.workspace.edge / 2
            return ground_under(self.workspace, self._origin, ray, above)
        return self.place(patch, surface.depth)


def split(patch: Patch, count: int) -> list[Patch]:
    """Divide a patch into `count` parts of about equal size (Lloyd's rounds from a regular start).

    Returns fewer when parts come out empty.
    """
    v, u = np.nonzero(patch.inside)
    points = np.column_stack([u, v]).astype(float)
    centres = _spread(points, count)
    for _ in range(ROUNDS):
        nearest = ((points[:, None] - centres[None]) ** 2).sum(axis=2).argmin(axis=1)
        sums = np.array([np.bincount(nearest, points[:, k], count) for k in (0, 1)]).T
        sizes = np.bincount(nearest, minlength=count)
        centres = np.where(sizes[:, None] > 0, sums / np.maximum(sizes, 1)[:, None], centres)
    parts = []
    for number in range(count):
        mine = nearest == number
        if mine.any():
            inside = np.zeros_like(patch.inside)
            inside[v[mine], u[mine]] = 255
            parts.append(patch_within(patch.colour, patch.contour, patch.box, inside))
    return parts


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Starting centres (count, 2): each the point farthest from those before."""
    chosen = [points[((points - points.mean(axis=0)) ** 2).sum(axis=1).argmax()]]
    distance = ((points - chosen[0]) ** 2).sum(axis=1)
    while len(chosen) < count:
        chosen.append(points[distance.argmax()])
        distance = np.minimum(distance, ((points - chosen[-1]) ** 2).sum(axis=1))
    return np.array(chosen)


def _valid(depths: np.ndarray, mask: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return (mask > 0) & (depths > 0.0) & (depths < np.inf)


def _is_long(patch: Patch, side: float) -> bool:
    """Whether a patch of less than two cubes is too long to be one."""
    if side < 1.2:
        return False
    (_, sides, _) = cv2.minAreaRect(patch.contour)
    return max(sides) + 1.0 > 1.6 * (min(sides) + 1.0)


def _purity(patch: Patch, masks: dict[str, np.ndarray]) -> float:
    counts = {name: cv2.countNonZero(patch.window(masks[name])) for name in CUBES}
    return counts[patch.colour] / max(1, sum(counts.values()))


def _without_doubles(cubes: list[Detection], edge: float) -> list[Detection]:
    """Of two colours at one place the larger patch: light at the border of two limits."""
    kept: list[Detection] = []
    for cube in sorted(cubes, key=lambda c: -c.patch.area):
        near = (c for c in kept if c.colour != cube.colour)
        if all(np.abs(c.position - cube.position).max() > 0.6 * edge for c in near):
            kept.append(cube)
    return kept


COLOURS = {number: name for name, number in CUBES.items()} | {Cube.COLOUR_UNKNOWN: "unknown"}
