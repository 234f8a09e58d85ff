# SPDX-License-Identifier: BSD-3-Clause
"""The tracker on rendered pictures of a running cell, beside the cell's truth."""

from collections import Counter

import numpy as np
import pytest
from camera_helpers import GEOMETRY, LINKS, PARAMETERS
from cell_helpers import SRC

from fabric_msgs.msg import Container, Cube
from fabric_perception.camera import Camera
from fabric_perception.tracking.bench import measure
from fabric_perception.tracking.carriers import Signals
from fabric_perception.tracking.colours import Palette
from fabric_perception.tracking.pipeline import Tracking
from fabric_perception.tracking.workspace import Workspace
from fabric_sim.batch_loop import HeadlessRun, RunSetup
from fabric_sim.camera.renderer import CellRenderer
from fabric_sim.camera.scene import Scene, SceneCube, SceneSource
from fabric_sim.cell_output import seen as truly_seen

CELL = SRC.parent / "launch/config/cell.yaml"
COLOURS = SRC / "fabric_perception/config/colours.yaml"
EYE = PARAMETERS.cell
CAMERA = Camera(EYE.K, EYE.width, EYE.height, EYE.pose)


def tracker(scenario):
    return Tracking(CAMERA, Workspace.load(CELL, scenario), Palette.load(COLOURS))


class WatchedTask(HeadlessRun):
    """A task in which every second tick is drawn and tracked, beside direct sensing."""

    def watch(self, seed):
        self.renderer = CellRenderer(GEOMETRY, LINKS, PARAMETERS, seed)
        self.source = SceneSource(self._cell, seed)
        self.tracking = tracker(self.setup.scenario)
        self.places, self.errors, self.truth, self.found = Counter(), [], [], []
        self.hand_errors = []

    def _next_moment(self):
        moment = super()._next_moment()
        self.source.step()
        if moment.percept is not None:
            self._look(moment)
        return moment

    def _look(self, moment):
        cell, t = self._cell, self._cell.now
        scene = self.source.scene()
        frame = self.renderer.render(scene)
        stands = cell.stock.belt.at_pick_point is not None
        signals = Signals(np.array(cell.cup), cell.stock.belt.speed, stands)
        if moment.containers is not None:
            self._compare_containers(moment.containers, t)
        seen = self.tracking.step(t, frame.rgb, frame.depth, signals)
        self.found += seen.deposits
        mine = {cube.id: cube for cube in seen.cubes}
        for cube, where, place in truly_seen(cell):
            told = mine.pop(cube.id, None)
            self.places["right" if told and told.where == where else "other"] += 1
            assert told is None or told.colour == cube.colour
            if told and told.age == 0.0 and where in (Cube.WHERE_BELT, Cube.WHERE_PICK_POINT):
                self.errors.append(told.position - place)
        self.places["unknown"] += len(mine)
        if seen.hand is not None and seen.hand.visible:
            self.hand_errors.append(seen.hand.position - scene.hand)

    def _compare_containers(self, told, t):
        known = {(cube, tray) for cube, tray, _ in self.truth}
        for row in told.containers:
            for cube in row.cube_ids:
                if (cube, row.id) not in known:
                    self.truth.append((cube, row.id, row.owner))
                    if row.owner == Container.OWNER_PERSON:
                        self.found += self.tracking.on_load_step(row.id, t)


@pytest.fixture(scope="module")
def task():
    setup = RunSetup("inspection", "expert_rested_attentive_collaborative", "none", seed=111)
    run = WatchedTask(setup, every_tick=True)
    run.watch(seed=111)
    run.run_task()
    run.renderer.close()
    return run


def test_every_deposit_of_the_task_is_found_once_with_cube_container_and_who(task):
    assert task.truth
    assert [(d.cube, d.tray, d.by) for d in task.found] == task.truth


def test_cubes_are_where_they_are_said_to_be(task):
    assert task.places["unknown"] == 0
    assert task.places["right"] > 0.93 * sum(task.places.values())


def test_places_on_the_belt_are_right_to_millimetres(task):
    errors = np.array(task.errors)
    assert len(errors) > 50
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 0.006


def test_the_hand_is_found_and_steadily_so(task):
    errors = np.array(task.hand_errors)
    assert len(errors) > 50
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 0.03
    assert errors.std(axis=0).max() < 0.02


@pytest.mark.parametrize("seed", range(112, 118))
def test_in_every_light_colours_are_right_and_clutter_is_no_cube_and_no_glove(seed):
    places = [(0.281, y, 0.1345) for y in (0.035, -0.1, -0.25)]
    cubes = tuple(
        SceneCube(colour, place, 0.2) for colour, place in zip((1, 2, 3), places, strict=True)
    )
    renderer = CellRenderer(GEOMETRY, LINKS, PARAMETERS, seed)
    tracking = tracker("sorting")
    scene = Scene(cubes=cubes, joints=(-1.4, 0.3, 0.4, 0.0))
    for k in range(7):
        frame = renderer.render(scene)
        seen = tracking.step(0.1 * k, frame.rgb, frame.depth, Signals(belt_speed=0.0))
    away = renderer.render(scene._replace(hand=(1.7, -0.4, 0.0), shoulder=(1.9, -0.4, 0.36)))
    renderer.close()
    assert sorted(cube.colour for cube in seen.cubes) == [1, 2, 3]
    assert min(cube.confidence for cube in seen.cubes) > 0.9
    assert np.linalg.norm(seen.hand.position - scene.hand) < 0.03
    assert not tracking.step(1.0, away.rgb, away.depth).hand.visible


def test_the_stages_are_measured_beside_plain_opencv():
    renderer = CellRenderer(GEOMETRY, LINKS, PARAMETERS, seed=118)
    frames = [renderer.render(Scene(cubes=(SceneCube(1, (0.281, -0.1, 0.1345), 0.1),)))] * 3
    renderer.close()
    pictures = [(frame.rgb, frame.depth) for frame in frames]
    rows = measure(pictures, CAMERA, Workspace.load(CELL, "sorting"), Palette.load(COLOURS))
    assert [row.stage for row in rows][-1] == "whole step"
    assert all(row.ms > 0.0 and row.plain_ms > 0.0 for row in rows)
