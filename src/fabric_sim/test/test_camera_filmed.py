# SPDX-License-Identifier: BSD-3-Clause
"""The cell that cameras see sends scenes and raw readings for labels; nothing else changes."""

import numpy as np
import pytest
from camera_helpers import CONFIGS, PARAMETERS, SCENES, small
from cell_helpers import CONFIG, B, G, R, task

from fabric_msgs.msg import RobotActionState, SimScene
from fabric_sim.camera import messages
from fabric_sim.camera.filmed import TOPICS, FilmedCell, SensorParameters
from fabric_sim.camera.hand import held_at
from fabric_sim.camera.scene import Scene, SceneCube
from fabric_sim.cell import Cell
from fabric_sim.quiescence import CAMERA_EDGES, CELL, Quiescence
from fabric_sim.staff import Staff
from fabric_sim.stock import Place
from fabric_sim.worker_events import PHASE_APPROACH, ROBOT_GRASP

SENSORS = SensorParameters.load(CONFIGS / "sensors.yaml")
HUMAN = "expert_rested_attentive_noncollaborative"


def filmed(seed=101, scenario="sorting"):
    cell = Cell(CONFIG, Staff(HUMAN, seed).worker(1), seed)
    runs = FilmedCell(cell, seed, SENSORS)
    cell.on_task(task(scenario, colours=(R, G, B)))
    cell.set_conveyor(0.05, False)
    return cell, runs


def played(seconds=60.0, **words):
    """The cell and all that it sent, a list of (topic, message) for each tick."""
    cell, runs = filmed(**words)
    sent = []
    for _ in range(round(seconds / 0.05)):
        sent.append([pair for stimulus in runs.step().stimuli() for pair in stimulus.messages])
    return cell, sent


@pytest.fixture(scope="module")
def run():
    return played()


def of(sent, topic):
    return [message for tick in sent for name, message in tick if name == topic]


def test_labels_are_not_sent(run):
    topics = {name for tick in run[1] for name, _ in tick}
    assert topics == {
        "truth",
        "conveyor/state",
        "sensors/load_cells",
        "sensors/infrared",
        "sim/scene",
    }
    assert topics == set(TOPICS)


def test_the_scene_comes_last_in_every_tick_and_stamped(run):
    for number, tick in enumerate(run[1], 1):
        assert tick[-1][0] == "sim/scene"
        assert tick[-1][1].header.stamp.to_sec() == pytest.approx(number / 20)


def test_what_happens_does_not_depend_on_who_watches():
    cell, _ = played(30.0)
    direct, _ = filmed()
    for _ in range(600):
        direct.step()
    for ours, theirs in zip(cell.stock.cubes.values(), direct.stock.cubes.values(), strict=True):
        assert (ours.place, ours.container) == (theirs.place, theirs.container)
    assert cell.worker.truth(30.0) == direct.worker.truth(30.0)


def test_a_placed_cube_weighs_on_its_tray_for_ever(run):
    cell, sent = run
    assert any(cube.place is Place.CONTAINER for cube in cell.stock.cubes.values())
    counts = np.array([message.counts[:3] for message in of(sent, "sensors/load_cells")])
    change = (np.median(counts[-40:], axis=0) - np.median(counts[:40], axis=0)) / 420.0
    expected = [
        18.0 * sum(c.container == tray for c in cell.stock.cubes.values()) for tray in (1, 2, 3)
    ]
    np.testing.assert_allclose(change, expected, atol=4.0)


def test_the_belt_says_what_its_light_barrier_sees(run):
    states = of(run[1], "conveyor/state")
    assert any(state.cube_at_pick_point for state in states)
    raw = [np.mean(message.blocked) > 0.5 for message in of(run[1], "sensors/infrared")]
    assert [state.cube_at_pick_point for state in states] == raw[1::2]


def test_the_hand_holds_the_cube_that_is_in_it(run):
    held = [scene for scene in of(run[1], "sim/scene") if scene.holding]
    assert held
    for scene in held:
        place = held_at(np.array((scene.hand.x, scene.hand.y, scene.hand.z)), CONFIG.geometry)
        gaps = [
            np.linalg.norm(np.array((c.position.x, c.position.y, c.position.z)) - place)
            for c in scene.cubes
        ]
        assert min(gaps) < 1e-9


def test_a_cube_hardly_jumps_when_a_hand_takes_it_or_puts_it_down(run):
    jumps, before = [], {}
    for scene in of(run[1], "sim/scene"):
        places = {
            colour: np.array((pose.position.x, pose.position.y, pose.position.z))
            for colour, pose in zip(scene.cube_colours, scene.cubes, strict=True)
        }
        jumps += [np.linalg.norm(places[c] - before[c]) for c in places.keys() & before.keys()]
        before = places
    assert len(jumps) > 1000
    assert max(jumps) < 0.14  # m in a tick: into the tray's corner at most


def test_a_warning_is_seen_in_the_scene():
    cell, runs = filmed()
    robot = RobotActionState(current=ROBOT_GRASP, phase=PHASE_APPROACH)
    raised = 0.0
    for tick in range(2400):
        if tick % 200 == 100:
            cell.on_robot_state(robot)
        if tick % 200 == 190:
            cell.on_robot_state(RobotActionState())
        scene = runs.step().stimuli()[-1].messages[0][1]
        raised = max(raised, scene.stop)
    assert raised == pytest.approx(1.0)


def test_a_scene_survives_its_message():
    scene = Scene(
        scenario="inspection", hand=(0.1, 0.2, 0.3), stop=0.5, yaw=-0.25, pitch=0.125,
        cubes=(SceneCube(G, (0.4, 0.5, 0.6), 0.75),), holding=True, t=2.5,
    )  # fmt: skip
    back = messages.scene_of_message(messages.scene_message(scene, 3))
    assert back.cubes[0].yaw == pytest.approx(0.75)
    assert back._replace(cubes=()) == scene._replace(cubes=())


def test_a_damaged_scene_is_refused():
    with pytest.raises(ValueError, match="2 colours of 0 cubes"):
        messages.scene_of_message(SimScene(cube_colours=[1, 2]))


def test_pictures_become_messages_with_their_calibration():
    lens = small().cell
    stamp = messages.scene_message(SCENES["work"], 1).header.stamp
    depth = np.full((240, 320), 1.5, np.float32)
    message = messages.image(stamp, lens, depth)
    assert (message.encoding, message.step, len(message.data)) == ("32FC1", 1280, 320 * 240 * 4)
    colour = messages.image(stamp, lens, np.zeros((240, 320, 3), np.uint8))
    assert (colour.encoding, colour.step) == ("bgr8", 960)
    info = messages.camera_info(stamp, lens)
    assert info.header.frame_id == message.header.frame_id == lens.frame
    np.testing.assert_allclose(np.reshape(info.K, (3, 3)), lens.K)
    assert (info.width, info.height) == (320, 240)


def test_the_cameras_stand_where_their_file_says():
    transform = messages.place_of(PARAMETERS.head)
    assert transform.header.frame_id == "cell"
    assert transform.child_frame_id == "head_camera_optical_frame"
    at = transform.transform.translation
    np.testing.assert_allclose((at.x, at.y, at.z), PARAMETERS.head.pose[:3, 3])


def test_with_cameras_perception_is_waited_for():
    who = {edge.topic: edge.publisher for edge in CAMERA_EDGES}
    assert who["human/activity"] == "gesture"
    assert who["cell/cubes"] == "tracking"
    assert who["conveyor/state"] == who["sim/scene"] == CELL
    Quiescence(["cell_camera", "head_camera", "tracking", "gesture", "head", "task"], CAMERA_EDGES)
    with pytest.raises(ValueError, match="expected node 'cell_camera'"):
        Quiescence(["cell_camera"])
