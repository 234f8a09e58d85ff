# SPDX-License-Identifier: BSD-3-Clause
"""Stage 3: where in the cell a patch is, from the median of its valid depths."""

import math
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
NEAREST, FARTHEST = 0.05, 20.0  # m; other depths are none
FEW = 5  # pixels with a depth, below which a median says nothing
ROUNDS = 5  # of the division of a patch into cubes
POINTS = 80  # pixels a cube that take part in them
HIGHEST = 1.0  # m above the table, of anything that is worked with
INFERRED = 3.0  # times the noise, of a place without depth
SQUARE_IN_VIEW = 1.1  # squared edges that a cube shows on average


class Detection(NamedTuple):
    """A cube in one picture.

    colour: Cube.COLOUR_*. position: (3,) of its middle, m in cell. sigma: m, standard deviation
    of it along an axis. purity: share of its colour among the coloured pixels around it.
    sight: the line it is seen along, (2, 3) point and direction of length 1, when it shows no
    depth; the position is then the one of a cube that lies there. None for a measured place.
    """

    colour: int
    position: np.ndarray
    sigma: float
    purity: float
    patch: Patch
    sight: np.ndarray | None = None

    def near(self, place: np.ndarray) -> "Detection":
        """The same cube, as near to a place (3,) as its picture allows."""
        if self.sight is None:
            return self
        start, along = self.sight
        return self._replace(position=start + ((place - start) @ along) * along)


class Surface(NamedTuple):
    """What is known of the visible side of a patch: m; depth along the optical axis."""

    depth: float  # NaN when too few pixels have one
    height: float  # median of the upper four fifths of its points in the cell
    relief: float  # between the 20th and the 80th percentile of the heights


class View:
    """A depth picture (H, W) float32 m, and which of its pixels count for a patch."""

    def __init__(self, depth: np.ndarray, masks: dict[str, np.ndarray]) -> None:
        """masks: (H, W) uint8 by colour, as segmented."""
        self.depth, self.masks = depth, masks
        # inRange, unlike a comparison in NumPy, is silent about NaN
        self.valid = cv2.inRange(depth, NEAREST, FARTHEST)
        self._inner: dict[str, np.ndarray] = {}

    def inner(self, colour: str) -> np.ndarray:
        """(H, W) uint8: valid pixels of a colour that are not at its border."""
        if colour not in self._inner:
            eroded = cv2.erode(self.masks[colour], BORDER)
            self._inner[colour] = cv2.bitwise_and(eroded, self.valid)
        return self._inner[colour]

    def depths(self, patch: Patch, least: float) -> tuple[np.ndarray, np.ndarray]:
        """Valid depths (N,) in a patch, of its inner pixels if these are `least` at least, and
        which pixels (height, width) of its box they are, as bool."""
        chosen = cv2.bitwise_and(patch.inside, patch.window(self.inner(patch.colour)))
        if cv2.countNonZero(chosen) < least:
            chosen = cv2.bitwise_and(patch.inside, patch.window(self.valid))
        where = chosen != 0
        return patch.window(self.depth)[where], where

    def known_share(self, patches: list[Patch]) -> float:
        """Share of the pixels in the boxes of patches that have a depth; 1 without a patch."""
        total = sum(patch.inside.size for patch in patches)
        known = sum(cv2.countNonZero(patch.window(self.valid)) for patch in patches)
        return known / total if total else 1.0


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
        self._height = float(camera.position[2])
        self._focal = math.sqrt(camera.K[0, 0] * camera.K[1, 1])

    # -- cubes ----------------------------------------------------------------------------------

    def cubes(self, patches: list[Patch], view: View) -> list[Detection]:
        """Return the cubes among patches of cubes' colours."""
        whole: list[tuple[Patch, Surface]] = []
        for patch in patches:
            whole += self._single_cubes(patch, self.surface(patch, view), view)
        if not whole:
            return []
        rays = self._rays([patch for patch, _ in whole])
        found = [
            self._cube(patch, surface, ray, view.masks)
            for (patch, surface), ray in zip(whole, rays, strict=True)
        ]
        return _without_doubles([cube for cube in found if cube], self.workspace.edge)

    def _single_cubes(
        self, patch: Patch, surface: Surface, view: View
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
        return [(part, self.surface(part, view)) for part in split(patch, count)]

    def _side(self, patch: Patch, surface: Surface) -> float:
        """Side of a square of the patch's area, in edges of a cube."""
        distance = surface.depth
        if math.isnan(distance):
            distance = float(self.camera.to_camera(self._ground(patch, surface)[None])[0, 2])
        return math.sqrt(patch.area) * distance / self._focal / self.workspace.edge

    def _cube(
        self, patch: Patch, surface: Surface, ray: np.ndarray, masks: dict[str, np.ndarray]
    ) -> Detection | None:
        """The outline of a body as symmetric as a cube has the body's middle for its middle, so
        only the height along the ray through it is left to find."""
        sigma, top, sight = self._parameters.cube_noise, surface.height, None
        if math.isnan(top):
            sight = np.array([self._origin, ray / np.linalg.norm(ray)])
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
        return Detection(CUBES[patch.colour], position, sigma, _purity(patch, masks), patch, sight)

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

    def surface(self, patch: Patch, view: View) -> Surface:
        """Depth of a patch: of the valid pixels that are not at its border."""
        least = max(FEW, self._parameters.depth_share * patch.area)
        values, where = view.depths(patch, least)
        count = values.size
        if count < least:
            return Surface(math.nan, math.nan, 0.0)
        heights = patch.window(self._rise)[where] * values
        heights.sort()
        upper = float(heights[(3 * count) // 5]) + self._height
        relief = float(heights[(4 * count) // 5] - heights[count // 5])
        values.sort()
        return Surface(float(values[count // 2]), upper, relief)

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
        if math.isnan(surface.depth):
            ray, above = self._rays([patch])[0], self.workspace.edge / 2
            return ground_under(self.workspace, self._origin, ray, above)
        return self.place(patch, surface.depth)


def split(patch: Patch, count: int) -> list[Patch]:
    """Divide a patch into `count` parts of about equal size (Lloyd's rounds from a regular start).

    Returns fewer when parts come out empty.
    """
    v, u = np.nonzero(patch.inside)
    points = np.column_stack([u, v]).astype(np.float32)
    few = points[:: max(1, len(points) // (POINTS * count))]
    centres = _spread(few, count)
    for _ in range(ROUNDS):
        nearest = _nearest(few, centres)
        sums = np.array([np.bincount(nearest, few[:, k], count) for k in (0, 1)]).T
        sizes = np.bincount(nearest, minlength=count)[:, None]
        centres = np.where(sizes > 0, sums / np.maximum(sizes, 1), centres).astype(np.float32)
    owner = np.zeros(patch.inside.shape, np.int32)
    owner[v, u] = _nearest(points, centres) + 1
    parts = (((owner == number + 1) * np.uint8(255)) for number in range(count))
    return [
        patch_within(patch.colour, patch.contour, patch.box, inside)
        for inside in parts
        if inside.any()
    ]


def _nearest(points: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Index (N,) of the centre (count, 2) that is nearest to each point (N, 2)."""
    return (points @ centres.T - 0.5 * (centres**2).sum(axis=1)).argmax(axis=1)


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Starting centres (count, 2): each the point farthest from those before."""
    chosen = [points[((points - points.mean(axis=0)) ** 2).sum(axis=1).argmax()]]
    distance = ((points - chosen[0]) ** 2).sum(axis=1)
    while len(chosen) < count:
        chosen.append(points[distance.argmax()])
        distance = np.minimum(distance, ((points - chosen[-1]) ** 2).sum(axis=1))
    return np.array(chosen)


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
