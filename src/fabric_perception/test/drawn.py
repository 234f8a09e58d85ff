# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the cell drawn with NumPy and OpenCV: boxes and balls, cast ray by ray."""

from pathlib import Path

import cv2
import numpy as np

from fabric_perception.camera import Camera
from fabric_perception.tracking.colours import Palette
from fabric_perception.tracking.workspace import Workspace

ROOT = Path(__file__).resolve().parents[3]
CELL = ROOT / "launch/config/cell.yaml"
COLOURS = ROOT / "src/fabric_perception/config/colours.yaml"
RED, GREEN, BLUE, YELLOW = (40, 40, 205), (60, 160, 40), (200, 80, 40), (40, 200, 230)
PAINT = {1: RED, 2: GREEN, 3: BLUE}
WOOD, GREY, CARDBOARD, SKIN = (150, 185, 205), (90, 90, 90), (107, 153, 194), (150, 180, 225)
NOISES = 4  # pictures of noise


def palette():
    return Palette.load(COLOURS)


def workspace(scenario="sorting"):
    return Workspace.load(CELL, scenario)


def camera(width=640, height=480):
    """Nearly straight above the middle of the cell, 0.95 m over the table."""
    f = 570.0 * width / 640.0
    K = [[f, 0.0, width / 2 - 0.5], [0.0, f, height / 2 - 0.5], [0.0, 0.0, 1.0]]
    return Camera(np.array(K), width, height, looking((0.62, 0.0, 1.05), (0.27, -0.03, 0.08)))


def looking(position, target):
    """Pose (4, 4) of a camera at a position that looks at a target, x of the picture along -y."""
    z = np.subtract(target, position) / np.linalg.norm(np.subtract(target, position))
    x = np.cross(z, (1.0, 0.0, 0.0))
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = position
    return pose


class Painter:
    """Draws scenes for one camera; the empty cell is drawn once."""

    def __init__(self, camera, workspace, seed=0):
        self.camera, self._rng = camera, np.random.default_rng(seed)
        v, u = np.mgrid[0 : camera.height, 0 : camera.width]
        rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
        self._rays = (rays @ camera.pose_in_cell[:3, :3].T).reshape(camera.height, camera.width, 3)
        self._noises = {}
        self._empty = self._draw_cell(workspace)
        self.clear()

    def clear(self):
        """Back to the empty cell."""
        self.bgr, self.depth = self._empty[0].copy(), self._empty[1].copy()
        return self

    def _draw_cell(self, workspace):
        self.bgr = np.full((self.camera.height, self.camera.width, 3), 60, np.uint8)
        self.depth = np.full((self.camera.height, self.camera.width), np.nan, np.float32)
        self.box((0.2, 0.0, -0.02), (1.4, 1.2, 0.04), WOOD)
        frame = workspace.conveyor
        length = workspace.end - workspace.feeder + workspace.edge
        middle = frame.to_cell(np.array([(workspace.end + workspace.feeder) / 2, 0.0, 0.0]))
        size = (length, workspace.width, frame.z)
        self.box((middle[0], middle[1], frame.z / 2), size, GREY, frame.yaw)
        for tray in workspace.trays:
            x, y, z = tray.floor
            self.box((x, y, z / 2), (*tray.size, z), CARDBOARD)
        return self.bgr, self.depth

    def box(self, middle, size, colour, yaw=0.0):
        """A box: (3,) m in cell, (3,) m, BGR, rad about z."""
        c, s = np.cos(yaw), np.sin(yaw)
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        origin = turn @ (self.camera.position - middle)

        def cast(rays):
            with np.errstate(divide="ignore", invalid="ignore"):
                rays = rays @ turn.T
                one, two = ((side * np.array(size) / 2 - origin) / rays for side in (-1, 1))
                near, far = np.minimum(one, two), np.maximum(one, two)
                depth = near.max(axis=-1)
                shade = np.array([0.72, 0.82, 1.0])[near.argmax(axis=-1)]
            return np.where((depth < far.min(axis=-1)) & (depth > 0.0), depth, np.inf), shade

        return self._cast(middle, np.linalg.norm(size) / 2, colour, cast)

    def ball(self, middle, radius, colour):
        """A ball: (3,) m in cell, m, BGR."""
        origin = self.camera.position - np.asarray(middle)

        def cast(rays):
            a, b = (rays**2).sum(axis=-1), rays @ origin
            root = b**2 - a * (origin @ origin - radius**2)
            with np.errstate(invalid="ignore"):
                depth = (-b - np.sqrt(root)) / a
            return np.where(root > 0.0, depth, np.inf), np.full(root.shape, 0.95)

        return self._cast(middle, radius, colour, cast)

    def cube(self, colour, middle, yaw=0.0, edge=0.025):
        """A cube of a colour of Cube.COLOUR_*."""
        return self.box(middle, (edge,) * 3, PAINT[colour], yaw)

    def glove(self, middle, yaw=np.pi):
        """A hand in a glove, fingers along yaw, and the forearm behind it."""
        c, s = np.cos(yaw), np.sin(yaw)

        def part(ahead, aside, size, colour=YELLOW, up=0.0):
            place = np.add(middle, (c * ahead - s * aside, s * ahead + c * aside, up))
            self.box(place, size, colour, yaw)

        part(-0.005, 0.0, (0.085, 0.085, 0.03))
        for finger in range(4):
            part(0.06, -0.033 + 0.022 * finger, (0.06, 0.016, 0.016), up=-0.008)
        part(0.02, 0.055, (0.05, 0.018, 0.018), up=-0.008)
        part(-0.16, 0.0, (0.22, 0.06, 0.05), SKIN)
        return self

    def picture(self, noise=0.0, blur=0.0, holes=0.0, depth_noise=0.0, light=1.0):
        """bgr, depth with noise (standard deviations), blur (pixels) and a share of holes."""
        bgr = cv2.convertScaleAbs(self.bgr, alpha=light)
        if blur:
            bgr = cv2.GaussianBlur(bgr, (0, 0), blur)
        if noise:
            grain = self._drawn(("grain", noise), lambda: self._grain(noise))
            bgr = cv2.add(bgr, grain, dtype=cv2.CV_8U)
        depth = self.depth.copy()
        if depth_noise:
            depth += self._drawn(("depth", depth_noise), lambda: self._depth_noise(depth_noise))
        if holes:
            depth[self._drawn(("holes", holes), lambda: self._holes(holes))] = np.nan
        return bgr, depth

    def _drawn(self, name, draw):
        """One of a few drawings of a kind of noise: drawing anew each time takes too long."""
        kept = self._noises.setdefault(name, [])
        if len(kept) < NOISES:
            kept.append(draw())
        return kept[int(self._rng.integers(len(kept)))]

    def _grain(self, sigma):
        return np.rint(self._rng.normal(0.0, sigma, self.bgr.shape)).astype(np.int16)

    def _depth_noise(self, sigma):
        return self._rng.normal(0.0, sigma, self.depth.shape).astype(np.float32)

    def _holes(self, share):
        height, width = self.depth.shape
        spots = (self._rng.random((height // 4, width // 4)) < share).astype(np.uint8)
        return cv2.resize(spots, (width, height), interpolation=cv2.INTER_NEAREST) > 0

    def _cast(self, middle, radius, colour, cast):
        """Draw a body that lies within `radius` m of its middle."""
        span = np.array([-radius, radius])
        corners = np.array(np.meshgrid(span, span, span)).reshape(3, -1).T + np.asarray(middle)
        pixels = self.camera.project(corners)
        limit = (self.camera.width, self.camera.height)
        near = np.nan_to_num(pixels)
        low = np.clip(np.floor(near.min(axis=0)), 0, limit).astype(int)
        high = np.clip(np.ceil(near.max(axis=0)) + 1, 0, limit).astype(int)
        if not np.isfinite(pixels).all():  # reaches behind the camera
            low, high = np.zeros(2, int), np.array(limit)
        part = (slice(low[1], high[1]), slice(low[0], high[0]))
        depth, shade = cast(self._rays[part])
        with np.errstate(invalid="ignore"):
            before = ~(depth >= self.depth[part]) & np.isfinite(depth)
        self.depth[part][before] = depth[before]
        self.bgr[part][before] = np.clip(shade[before][:, None] * colour, 0, 255)
        return self
