# SPDX-License-Identifier: BSD-3-Clause
"""The headless loop on pictures: cell, cameras, perception and robot in one process."""

import shutil
import subprocess
import sys

import pytest

from fabric_bringup import arguments
from fabric_msgs.msg import Cube, HumanActivity
from fabric_sim import batch
from fabric_sim.batch_camera import CameraRun
from fabric_sim.batch_files import Files
from fabric_sim.batch_loop import RunSetup
from fabric_sim.camera.drawing import CannotDraw

PERSON = "expert_rested_attentive_collaborative"
SETUP = RunSetup("inspection", PERSON, "reactive", 101)
SECONDS = 6.0  # of a task: the cube is on its way


class Beginning(CameraRun):
    """The first seconds of a task; kept: what was seen, and what of it was true."""

    def __init__(self, setup):
        super().__init__(setup)
        self.sights, self.truths, self.behaviours = [], [], []
        see = self._eyes.see
        self._eyes.see = lambda scene: self._keep(see(scene))

    def _keep(self, sights):
        if sights is not None:
            self.sights.append(sights)
            self.truths.append({cube.id: where for cube, where in self._cell.stock.seen()})
            self.behaviours.append(self._cell.behaviour)
        return sights

    def _run_to_the_end(self):
        end = self._cell.now + SECONDS
        while self._cell.now < end:
            self._go_through_tick()


@pytest.fixture(scope="module")
def begun():
    with Beginning(SETUP) as run:
        run.run_task()
    return run


def test_equal_setups_are_seen_equally_picture_by_picture(begun):
    with Beginning(SETUP) as again:
        again.run_task()
    assert len(again.sights) == SECONDS * 10
    assert again.sights == begun.sights
    assert again.event_log() == begun.event_log()


def test_a_cube_is_seen_where_it_is_and_the_person_all_the_time(begun):
    seen = [{cube.id: cube.where for cube in sights.cubes.cubes} for sights in begun.sights]
    right = [told == true for told, true in zip(seen, begun.truths, strict=True) if true]
    assert len(right) > 20
    assert sum(right) >= 0.8 * len(right)
    assert seen[-1] != {} and Cube.WHERE_BELT in {where for told in seen for where in told.values()}
    people = [pair for sights in begun.sights[5:] for pair in sights.pairs]
    assert len(people) == len(begun.sights) - 5
    assert all(pair.activity.detected and pair.head.visible for pair in people)


def test_a_hand_that_rests_is_told_to_rest(begun):
    told = [
        pair.activity.posterior[HumanActivity.IDLE] > 0.5
        for sights in begun.sights[5:]
        for pair in sights.pairs
    ]
    assert {behaviour.activity for behaviour in begun.behaviours} == {HumanActivity.IDLE}
    assert sum(told) >= 0.95 * len(told)


def test_pictures_have_errors_of_their_own():
    with pytest.raises(ValueError, match=r"noise is 0\.1; pictures have their own"):
        CameraRun(RunSetup(noise=0.1))


@pytest.mark.parametrize(
    ("package", "name", "text", "words"),
    [
        ("fabric_perception", "config/gestures.yaml", "look_back: .nan", r"look_back is nan"),
        ("fabric_perception", "config/gestures.yaml", "shout: 1", r"unknown parameter 'shout'"),
        ("fabric_perception", "config/head.yaml", "[1, 2]", r"in place of named entries"),
        ("fabric_perception", "config/tracking.yaml", "{", r"tracking\.yaml: "),
        ("fabric_perception", "config/load_cells.yaml", "cube: 18.0", r"counts_per_gram is miss"),
        ("fabric_perception", "config/colours.yaml", "red: 7", r"colours\.yaml"),
        ("fabric_perception", "models/gestures.yaml", "format: else", r"gestures\.yaml"),
        ("fabric_sim", "config/camera.yaml", "rate: 7", r"rate"),
        ("fabric_sim", "config/sensors.yaml", "", r"sensors\.yaml"),
    ],
)
def test_damaged_settings_are_refused_by_file(tmp_path, package, name, text, words):
    shipped = Files()
    for folder in ("config", "models"):
        if (shipped.share(package) / folder).is_dir():
            shutil.copytree(shipped.share(package) / folder, tmp_path / folder)
    (tmp_path / name).write_text(text)
    files = Files(share=lambda wanted: tmp_path if wanted == package else shipped.share(wanted))
    with pytest.raises(ValueError, match=words) as refusal:
        CameraRun(SETUP, files)
    assert (tmp_path / name).name in str(refusal.value)


@pytest.fixture
def without_mujoco(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "fabric_sim.camera.renderer", raising=False)


@pytest.mark.usefixtures("without_mujoco")
def test_without_a_renderer_a_run_says_what_is_missing():
    with pytest.raises(CannotDraw, match=r"(?s)cannot draw .*mujoco.*libegl1.*sensing:=direct"):
        CameraRun(SETUP)


def words(folder, *more):
    return [f"{k}:={v}" for k, v in arguments.parse(
        "batch", ["scenario:=inspection", f"human:={PERSON}", "policy:=reactive", "seed:=101",
                  "tasks:=1", f"out_dir:={folder}", *more]).items()]  # fmt: skip


@pytest.mark.usefixtures("without_mujoco")
def test_without_a_renderer_a_batch_ends_before_it_writes_anything(tmp_path, capsys):
    assert batch.main(words(tmp_path / "run", "sensing:=camera")) == 2
    assert "fabric: sensing:=camera cannot draw the cell" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_batch_on_pictures_ends_with_its_results(tmp_path):
    command = [sys.executable, "-m", "fabric_sim.batch"]
    command += words(tmp_path / "run", "sensing:=camera")
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    rows = (tmp_path / "run" / "results.csv").read_text().splitlines()
    assert len(rows) == 2
    row = dict(zip(rows[0].split(","), rows[1].split(","), strict=True))
    assert (row["human"], row["success"], row["false_warnings"]) == (PERSON, "1", "0")
    assert "event log" in told.stdout


@pytest.mark.usefixtures("begun")
def test_a_batch_in_a_process_that_has_drawn_is_refused(tmp_path, capsys):
    assert batch.main(words(tmp_path / "run", "sensing:=camera")) == 2
    assert "survive that: start it from" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_only_direct_and_camera_are_kinds_of_sensing():
    assert arguments.parse("batch", [])["sensing"] == "direct"
    with pytest.raises(arguments.ArgumentError, match="one of direct, camera"):
        arguments.parse("batch", ["sensing:=radar"])
