# SPDX-License-Identifier: BSD-3-Clause
"""Cameras and perception of a run in one process: scenes in, percepts out, as the nodes do it.

    eyes = Eyes(Files(), seed=1)
    eyes.session.on_task(task_state)
    sights = eyes.see(scene_message)    # None between two pictures
    eyes.close()

Every process draws with a renderer of its own, in the thread that made it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import cv2
import yaml
from std_msgs.msg import Header

from fabric_msgs.msg import ContainerArray, CubeArray, HandState, SimScene
from fabric_msgs.settings import settings_from
from fabric_perception.camera import Camera
from fabric_perception.camera_poses import PARENT
from fabric_perception.gestures import model_file, places
from fabric_perception.gestures.recogniser import (
    GesturePercept,
    GestureRecogniser,
    RecogniserParameters,
)
from fabric_perception.head.helmet import load_helmet
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.tracker import HeadTracker
from fabric_perception.pairing import Pair, StampPairing
from fabric_perception.parameters import ObservationParameters
from fabric_perception.tracking.colours import Palette
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.session import TrackingSession
from fabric_perception.tracking.weighing import Scales, scale_parameters
from fabric_perception.tracking.workspace import Workspace
from fabric_sim import reports
from fabric_sim.batch_files import Files
from fabric_sim.camera import messages
from fabric_sim.camera.drawing import open_renderer
from fabric_sim.camera.parameters import TICK_RATE, CameraParameters, Lens

Made = TypeVar("Made")


class SeenHands(NamedTuple):
    """What gesture recognition says, in the fields of fabric_msgs/HumanActivity."""

    posterior: list[float]
    detected: bool
    evidence_age: float  # s


class SeenHead(NamedTuple):
    """What the head tracker says, in the fields of fabric_msgs/HeadState that are used."""

    visible: bool
    looking_around: bool


class Sights(NamedTuple):
    """What perception says of one moment. pairs: hands and head that belong together."""

    cubes: CubeArray
    hand: HandState
    containers: ContainerArray | None
    warning: bool
    pairs: list[Pair]


class Eyes:
    """The camera node and the nodes of perception. session: the tracker among its devices."""

    def __init__(self, files: Files, seed: int) -> None:
        """seed: root seed of the run; decides looks and noise of the pictures.

        Raises ValueError naming a file or setting that is wrong, CannotDraw without MuJoCo or EGL.
        """
        own, sim = files.share("fabric_perception") / "config", files.share("fabric_sim") / "config"
        cell = files.share("fabric_bringup") / "config/cell.yaml"
        helmet = own / "helmet.yaml"
        self._cameras = CameraParameters.load(sim / "camera.yaml", sim / "cameras.yaml", helmet)
        self.session = self._session(own, cell)
        model = files.share("fabric_perception") / "models/gestures.yaml"
        self._gestures = _recogniser(model, own / "gestures.yaml", cell)
        head = _read(own / "head.yaml", lambda values: settings_from(HeadParameters, values))
        self._head = HeadTracker(_camera(self._cameras.head), load_helmet(helmet), head)
        self._pairing = StampPairing()
        limits = files.share("fabric_dobot_driver") / "config/magician.yaml"
        self._renderer = open_renderer(cell, limits, self._cameras, seed)

    def close(self) -> None:
        """Give back the graphics memory."""
        self._renderer.close()

    def see(self, scene: SimScene) -> Sights | None:
        """Draw the scene if a picture is due and say what is seen in it.

        Raises ValueError for a scene that cannot be drawn or whose time does not go on.
        """
        stamp = scene.header.stamp
        t = stamp.to_sec()
        if round(t * TICK_RATE) % self._cameras.every:
            return None
        frame = self._renderer.render(messages.scene_of_message(scene))
        answer = self.session.on_pictures(Header(stamp=stamp, frame_id=PARENT), *frame[:2])
        self._gestures.on_cubes(t, answer.cubes.cubes)
        at = answer.hand.position
        hand = self._gestures.on_hand(t, (at.x, at.y, at.z) if answer.hand.visible else None)
        looks = self._head.step(t, cv2.cvtColor(frame.head, cv2.COLOR_BGR2GRAY))
        head = SeenHead(looks.visible, looks.looking_around)
        pairs = self._pairing.add_head(stamp.to_nsec(), head)
        if hand is not None:
            pairs += self._pairing.add_activity(stamp.to_nsec(), _hands(hand))
        warning = hand is not None and hand.warning
        return Sights(answer.cubes, answer.hand, answer.containers, warning, pairs)

    def _session(self, own: Path, cell: Path) -> TrackingSession:
        session = TrackingSession(
            Workspace.load(cell),
            Palette.load(own / "colours.yaml"),
            _read(own / "tracking.yaml", lambda values: settings_from(TrackingParameters, values)),
            Scales(_read(own / "load_cells.yaml", scale_parameters)),
        )
        session.use_camera(_camera(self._cameras.cell))
        return session


def observation_parameters(files: Files) -> ObservationParameters:
    """How percepts become observations when cameras see. Raises ValueError naming the file."""
    own = files.share("fabric_perception") / "config"
    common = _read(own / "observation.yaml", dict)
    return _read(
        own / "observation_camera.yaml",
        lambda values: settings_from(ObservationParameters, {**common, **values}),
    )


def _recogniser(model: Path, settings: Path, cell: Path) -> GestureRecogniser:
    trained = model_file.load(model)
    trained = trained._replace(features=places.in_cell(trained.features, cell))
    return _read(
        settings,
        lambda values: GestureRecogniser(trained, settings_from(RecogniserParameters, values)),
    )


def _read(path: Path, make: Callable[[dict[str, Any]], Made]) -> Made:
    """Return what `make` makes of the entries of a YAML file; refusals name the file."""
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
        if not isinstance(values, dict):
            raise ValueError(f"it holds {values!r} in place of named entries")
        return make(values)
    except (OSError, UnicodeDecodeError, yaml.YAMLError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from error


def _camera(lens: Lens) -> Camera:
    return Camera(lens.K, lens.width, lens.height, lens.pose)


def _hands(percept: GesturePercept) -> SeenHands:
    """In the precision of the messages."""
    posterior = [reports.single(p) for p in percept.posterior]
    return SeenHands(posterior, percept.detected, reports.single(percept.evidence_age))
