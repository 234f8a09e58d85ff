# SPDX-License-Identifier: BSD-3-Clause
"""Measures the stages of perception; `./fabric bench perception` measures the nodes as well.

A sorting task is played without ROS and drawn as the cameras of the cell see it; then every stage
of tracking, the head tracker and the gesture classifier work on these pictures, beside the plain
OpenCV calls each is built on. CPU time of one thread, least of some rounds. From the picture to the
activity: the work of a frame in the order of the nodes, without what ROS adds. With --json each
figure is one JSON object on its own line, the first of them the hardware.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import yaml

from fabric_msgs.settings import settings_from
from fabric_perception.camera import Camera
from fabric_perception.gestures.model_file import load
from fabric_perception.gestures.recogniser import GestureRecogniser, RecogniserParameters
from fabric_perception.head import bench as head_bench
from fabric_perception.head.helmet import load_helmet
from fabric_perception.head.parameters import HeadParameters
from fabric_perception.tracking.bench import measure as measure_tracking
from fabric_perception.tracking.colours import Palette
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.pipeline import Tracking
from fabric_perception.tracking.workspace import Workspace
from fabric_planner.bench_record import Figure, beside, figure, hardware
from fabric_planner.bench_report import line, table
from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.camera.parameters import CameraParameters
from fabric_sim.camera.renderer import CellRenderer, Frame
from fabric_sim.camera.scene import Scene, SceneSource

SCENARIO, HUMAN, SEED = "sorting", "expert_rested_attentive_collaborative", 101
RATE = 30.0  # Hz of the cameras
WARM = 8.0  # s of the task before the first picture: cubes have come into view
PICTURES = 90
ROUNDS = 5
QUICK = (20, 1)  # pictures, rounds
RATIO = 1.5  # of the plain calls that a stage may cost
SHARE = 60.0  # % of a core that perception may cost at RATE
LATENCY = 60.0  # ms from the picture to the activity, p95
HELMET_PICTURES = 60
Picture = tuple[np.ndarray, np.ndarray]  # (H, W, 3) uint8 blue first, (H, W) m


class Setup(NamedTuple):
    """All that perception is told before the first picture."""

    camera: Camera
    workspace: Workspace
    palette: Palette
    tracking: Any
    parameters: CameraParameters
    files: Files

    @classmethod
    def load(cls) -> Setup:
        """Read the shipped files."""
        files = Files()
        own, sim = files.share("fabric_perception") / "config", files.share("fabric_sim") / "config"
        helmet = own / "helmet.yaml"
        parameters = CameraParameters.load(sim / "camera.yaml", sim / "cameras.yaml", helmet)
        eye = parameters.cell
        return cls(
            Camera(eye.K, eye.width, eye.height, eye.pose),
            Workspace.load(files.share("fabric_bringup") / "config/cell.yaml", SCENARIO),
            Palette.load(own / "colours.yaml"),
            settings_from(TrackingParameters, _yaml(own / "tracking.yaml")),
            parameters,
            files,
        )


class Work(NamedTuple):
    """What one picture took: CPU ms of tracking and of the gesture."""

    tracking: float
    gesture: float


class FilmedTask(HeadlessRun):
    """A task whose scenes are kept, as many as are asked for."""

    def film(self, wanted: int) -> list[Scene]:
        """Run until there are so many scenes, one a tick."""
        self._source = SceneSource(self._cell, self.setup.seed)
        self._scenes: list[Scene] = []
        while len(self._scenes) < wanted:
            self.run_task()
        return self._scenes[:wanted]

    def _next_moment(self) -> Any:
        moment = super()._next_moment()
        self._source.step()
        if self._cell.now >= WARM:
            self._scenes.append(self._source.scene())
        return moment


def frames(setup: Setup, count: int) -> list[Frame]:
    """What the cameras see of a person at work, one after another."""
    run = FilmedTask(RunSetup(SCENARIO, HUMAN, "none", SEED), setup.files, every_tick=True)
    scenes = run.film(count)
    limits = setup.files.share("fabric_dobot_driver") / "config/magician.yaml"
    cell = setup.files.share("fabric_bringup") / "config/cell.yaml"
    renderer = CellRenderer.of_files(cell, limits, setup.parameters, SEED)
    seen = [renderer.render(scene) for scene in scenes]
    renderer.close()
    return seen


def measure(count: int, rounds: int) -> Iterator[Figure]:
    """All figures."""
    setup = Setup.load()
    film = [(frame.rgb, frame.depth) for frame in frames(setup, count)]
    yield from _tracking(setup, film)
    work = _whole(setup, film)
    own = setup.files.share("fabric_perception") / "config"
    head = head_bench.measure(
        load_helmet(own / "helmet.yaml"),
        settings_from(HeadParameters, _yaml(own / "head.yaml")),
        min(count, HELMET_PICTURES), SEED, rounds,
    )  # fmt: skip
    yield from _head(head)
    yield from costs(work, head["head_ms"])


def _tracking(setup: Setup, film: Sequence[Picture]) -> Iterator[Figure]:
    rows = measure_tracking(film, setup.camera, setup.workspace, setup.palette, setup.tracking)
    for row in rows:
        name = "tracking" if row.stage == "whole step" else row.stage
        yield stage(name, row.ms, row.plain_ms, judged=row.stage == "whole step")


def _head(found: dict[str, Any]) -> Iterator[Figure]:
    yield stage("head", found["head_ms"], found["opencv_ms"], judged=True)
    yield stage("head search", found["search_ms"], found["opencv_april_ms"], judged=False)
    yield _figure("yaw_error", found["yaw_max_deg"], "deg", at_most=2.0, detail="largest")


def costs(work: Sequence[Work], head_ms: float) -> Iterator[Figure]:
    """The figures of whole pictures; head_ms: CPU time of a picture of the head."""
    gesture = np.mean([picture.gesture for picture in work])
    total = np.mean([picture.tracking + picture.gesture for picture in work]) + head_ms
    latency = np.percentile([picture.tracking + picture.gesture for picture in work], 95)
    yield _figure("gesture", float(gesture), "ms", detail="a picture")
    share = 0.1 * float(total) * RATE
    yield _figure("core", share, "%", at_most=SHARE, detail=f"of one at {RATE:g} Hz")
    yield _figure(
        "latency", float(latency), "ms", at_most=LATENCY, detail="picture to activity, p95",
        time="CPU time, without what ROS adds", pictures=len(work),
    )  # fmt: skip


def _whole(setup: Setup, film: Sequence[Picture]) -> list[Work]:
    """Tracking and gesture on every picture, in the order of the nodes."""
    tracking = Tracking(setup.camera, setup.workspace, setup.palette, setup.tracking)
    own = setup.files.share("fabric_perception") / "config/gestures.yaml"
    told = settings_from(RecogniserParameters, _yaml(own))
    gesture = GestureRecogniser(load(None), told)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return [_work(tracking, gesture, i / RATE, *pair) for i, pair in enumerate(film, start=1)]
    finally:
        cv2.setNumThreads(threads)


def _work(
    tracking: Tracking, gesture: GestureRecogniser, t: float, bgr: np.ndarray, depth: np.ndarray
) -> Work:
    start = time.process_time()
    seen = tracking.step(t, bgr, depth)
    middle = time.process_time()
    hand = seen.hand.position if seen.hand is not None and seen.hand.visible else None
    gesture.on_hand(t, hand)
    return Work(1e3 * (middle - start), 1e3 * (time.process_time() - middle))


def stage(name: str, ms: float, plain_ms: float, judged: bool) -> Figure:
    """A stage beside the plain calls; the whole of a part is judged by the ratio."""
    limit = RATIO * plain_ms if judged else None
    own = _figure(name, ms, "ms", at_most=limit, detail="a picture", ratio=ms / plain_ms)
    return beside(own, "plain OpenCV", plain_ms)


def _figure(name: str, value: float, unit: str, **more: object) -> Figure:
    return figure(name, "640x480", value, unit, bench="perception", **more)


def _yaml(path: Path) -> dict[str, Any]:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def parser() -> argparse.ArgumentParser:
    """What can be said on the command line."""
    result = argparse.ArgumentParser(prog="fabric bench perception", description="Perception.")
    result.add_argument("--quick", action="store_true", help="fewer pictures, worse figures")
    result.add_argument("--json", action="store_true", help="one JSON object a line")
    return result


def no_more(quick: bool) -> Iterator[Figure]:
    """What is measured beside the stages: nothing."""
    yield from ()


def main(
    argv: Sequence[str] | None = None, more: Callable[[bool], Iterator[Figure]] = no_more
) -> int:
    """Measure the stages, then `more(quick)`; return the exit code."""
    arguments = parser().parse_args(argv)
    show: Callable[[Figure], str] = json.dumps if arguments.json else line
    measured = [hardware() | {"bench": "perception", "time": "CPU time, least of some rounds"}]
    print(show(measured[0]), flush=True)
    count, rounds = QUICK if arguments.quick else (PICTURES, ROUNDS)
    for found in itertools.chain(measure(count, rounds), more(arguments.quick)):
        print(show(found), flush=True)
        measured.append(found)
    if not arguments.json:
        print("\n" + table(measured))
    return 0


if __name__ == "__main__":
    sys.exit(main())
