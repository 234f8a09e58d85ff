# SPDX-License-Identifier: BSD-3-Clause
"""From a pair of pictures to hand, cubes and deposits: the five stages in their order."""

import math
from typing import NamedTuple

import numpy as np

from fabric_msgs.msg import Cube
from fabric_perception.camera import Camera
from fabric_perception.tracking.carriers import Signals
from fabric_perception.tracking.colours import CUBES, GLOVE, Palette
from fabric_perception.tracking.containers import Containers, Deposit
from fabric_perception.tracking.contours import Patch, find_patches
from fabric_perception.tracking.hand import HandTrack, HandTracker, Refusal
from fabric_perception.tracking.images import ImageError, check_pictures
from fabric_perception.tracking.measuring import Detection, Measuring, View
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.segmentation import Segmenter
from fabric_perception.tracking.sight import look
from fabric_perception.tracking.tracker import CubeTracker
from fabric_perception.tracking.workspace import Workspace, flat_depth


class SeenCube(NamedTuple):
    """A cube that is tracked.

    id: from 1, in the order of arrival on the belt. colour: Cube.COLOUR_*. position: (3,) m of its
    middle in cell. confidence: probability of the colour. age: s since it was last measured.
    where: Cube.WHERE_*.
    """

    id: int
    colour: int
    position: np.ndarray
    confidence: float
    age: float
    where: int


class Seen(NamedTuple):
    """What one pair of pictures shows. refusals: yellow patches that are no glove, and why."""

    t: float
    hand: HandTrack | None
    cubes: list[SeenCube]
    deposits: list[Deposit]
    detections: list[Detection]
    refusals: list[Refusal]
    depth_share: float  # of the coloured patches had a depth; 1 without any patch


class Tracking:
    """Follows cubes and glove through the pictures of one camera."""

    def __init__(
        self,
        camera: Camera,
        workspace: Workspace,
        palette: Palette,
        parameters: TrackingParameters | None = None,
    ) -> None:
        self.camera, self.workspace = camera, workspace
        self.parameters = parameters or TrackingParameters()
        flat = flat_depth(workspace, camera, self.parameters.ground_margin)
        self.segmenter = Segmenter(palette, flat)
        self.measuring = Measuring(camera, workspace, self.parameters)
        self.cubes = CubeTracker(workspace, self.parameters)
        self.hand = HandTracker(self.measuring, self.parameters)
        self.containers = Containers(workspace, self.parameters)
        self._t = -math.inf

    def start_task(self) -> None:
        """Forget all cubes: the next one on the belt is number 1. The hand is kept."""
        self.cubes.reset()
        self.containers.reset()

    def restart(self) -> None:
        """Forget everything; the next pictures may be of any time."""
        self.start_task()
        self.hand.reset()
        self._t = -math.inf

    def step(
        self, t: float, bgr: np.ndarray, depth: np.ndarray, signals: Signals | None = None
    ) -> Seen:
        """Take a pair of pictures of time t (s).

        bgr: (H, W, 3) uint8. depth: (H, W) float32 m, NaN or 0 where there is none. Raises
        ImageError for other shapes or types, and when t is not later than before; then nothing
        has changed.
        """
        check_pictures(bgr, depth, self.camera.width, self.camera.height)
        self._check_time(t)
        signals = signals or Signals()
        patches, masks = self.find(bgr, depth)
        view = View(depth, masks)
        cubes = self.measuring.cubes([p for p in patches if p.colour in CUBES], view)
        hand = self.hand.step(t, (p for p in patches if p.colour == GLOVE), view)
        self.cubes.step(
            t,
            cubes,
            hand,
            signals,
            lambda places: look(self.camera, depth, places, self.workspace.edge),
        )
        deposits = self.containers.update(t, self.cubes.tracks)
        self._t = t
        return Seen(
            t,
            hand,
            self.seen_cubes(t, signals),
            deposits,
            cubes,
            self.hand.refusals,
            view.known_share(patches),
        )

    def find(self, bgr: np.ndarray, depth: np.ndarray) -> tuple[list[Patch], dict[str, np.ndarray]]:
        """Stages 1 and 2: patches of all colours, and the masks they come from."""
        masks = self.segmenter.masks(bgr, depth)
        return find_patches(masks, self.parameters.least_area), masks

    def on_load_step(self, tray: int, t: float, cubes: int = 1) -> list[Deposit]:
        """A load cell tells of so many cubes more, at time t (s), in a person's tray.

        t: when its level began to stand still. cubes: negative when some were taken out. Returns
        the deposits if it is known already which cubes those were; else a later `step` does.
        Raises ValueError for a container without a load cell.
        """
        self.containers.step(tray, t, cubes)
        return self.containers.update(max(t, self._t), self.cubes.tracks)

    def seen_cubes(self, t: float, signals: Signals) -> list[SeenCube]:
        """The cubes of the task that are somewhere known, by number."""
        found = []
        for number, track in self.cubes.tracks.items():
            missing = track.missing is not None and (
                t - track.missing > self.parameters.lost_after or track.tray is not None
            )
            where = None if missing else track.where(signals)
            if where is not None:
                found.append(
                    SeenCube(
                        number,
                        track.colour,
                        track.position,
                        track.confidence(t),
                        track.age(t),
                        where,
                    )
                )
        return found

    def _check_time(self, t: float) -> None:
        if not math.isfinite(t):
            raise ImageError(f"the stamp of the pictures is {t}")
        if t <= self._t:
            raise ImageError(f"the pictures of {t} s come after those of {self._t} s")


WHERE_NAMES = {
    Cube.WHERE_BELT: "belt",
    Cube.WHERE_PICK_POINT: "pick point",
    Cube.WHERE_PERSON: "person",
    Cube.WHERE_ROBOT: "robot",
    Cube.WHERE_CONTAINER: "container",
}
