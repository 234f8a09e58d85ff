# SPDX-License-Identifier: BSD-3-Clause
"""The cell as a MuJoCo model: what stands still, the arm as a chain of joints, the rest as bodies
that are put where they are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from fabric_dobot_driver import Links
from fabric_msgs.msg import Container
from fabric_sim.camera.looks import Appearance
from fabric_sim.camera.parameters import CameraParameters, Lens
from fabric_sim.camera.person_shape import person
from fabric_sim.camera.place import quaternion_of
from fabric_sim.camera.shapes import body, box, capsule, cylinder, geom, numbers
from fabric_sim.geometry import CellGeometry, Tray

CUBES = 24  # that can be shown at once
WALL, THICK = 0.032, 0.003  # m, of a tray
NEAR, FAR = 0.05, 6.0  # m, that a camera can see
STEEL, RUBBER, SHELL, DARK = (
    (0.56, 0.57, 0.59),
    (0.13, 0.13, 0.14),
    (0.90, 0.90, 0.89),
    (0.22, 0.23, 0.25),
)
TRAY, BOX = (0.83, 0.83, 0.81), (0.45, 0.46, 0.48)
OFF_SIDE = 0.30  # m, from the arm's base to the wall behind it
FLOOR, BACK = -0.75, 2.3  # m: height of the floor, and x of the wall behind the person


class Model(NamedTuple):
    """The text of a model and the pictures that it needs, by file name."""

    xml: str
    assets: dict[str, bytes]


def model_of(
    geometry: CellGeometry,
    links: Links,
    parameters: CameraParameters,
    look: Appearance,
    shadows: bool = False,
) -> Model:
    """Return the model of the cell as it looks in one run."""
    width = max(parameters.cell.width, parameters.head.width)
    height = max(parameters.cell.height, parameters.head.height)
    markers = {f"marker{p.id}.png": _marker(parameters.dictionary, p.id) for p in parameters.plates}
    assets = {"table.png": _png(look.table_texture), "belt.png": _png(look.belt_texture), **markers}
    parts = [
        *_room(look, shadows),
        *_table(geometry, look),
        *_conveyor(geometry),
        *_arm(geometry, links),
        *(_trays(name, trays) for name, trays in geometry.scenarios.items()),
        *_cubes(geometry.edge * look.cube_size),
        *person(look, parameters.plates),
        _camera("cell", parameters.cell),
        _camera("head", parameters.head),
    ]
    xml = f"""<mujoco model="fabric_cell">
<visual><global offwidth="{width}" offheight="{height}"/>
<quality offsamples="0" shadowsize="2048" numslices="20" numstacks="10" numquads="2"/>
<map znear="{NEAR}" zfar="{FAR}"/>
<headlight ambient="{numbers(look.ambient)}" diffuse="0.12 0.12 0.12" specular="0 0 0"/></visual>
<statistic extent="1" center="0.3 0 0"/>
<asset>{_textures(assets)}</asset>
<worldbody>{"".join(parts)}</worldbody></mujoco>"""
    return Model(xml, assets)


def _textures(assets: Iterable[str]) -> str:
    text = ""
    for name in assets:
        stem = name.removesuffix(".png")
        repeat = {"belt": "2 8"}.get(stem, "1 1")
        shine = "0.35" if stem == "belt" else "0.05"
        text += f'<texture name="{stem}" type="2d" file="{name}"/>'
        text += (
            f'<material name="{stem}" texture="{stem}" texrepeat="{repeat}" specular="{shine}"/>'
        )
    return text


def _camera(name: str, lens: Lens) -> str:
    """MuJoCo's cameras look along -z with y up."""
    flip = np.diag([1.0, -1.0, -1.0])
    fovy = 2.0 * math.degrees(math.atan(lens.height / 2.0 / lens.focal))
    quaternion = quaternion_of(lens.pose[:3, :3] @ flip)
    place = f'pos="{numbers(lens.pose[:3, 3])}" quat="{numbers(quaternion)}"'
    return f'<camera name="{name}" {place} fovy="{fovy:.6f}"/>'


def _room(look: Appearance, shadows: bool) -> list[str]:
    cast = "true" if shadows else "false"
    x, y, z = look.lamp_at
    aim = numbers((0.3 - x, -y, -z))
    lamp = f'<light pos="{numbers(look.lamp_at)}" dir="{aim}" diffuse="{numbers(look.lamp)}" '
    lamp += f'specular="0.3 0.3 0.3" cutoff="80" exponent="1" castshadow="{cast}"/>'
    side = numbers(0.45 * np.array(look.lamp))
    window = f'<light pos="-0.6 1.4 1.2" dir="0.9 -1.2 -0.6" diffuse="{side}" specular="0 0 0" '
    window += 'cutoff="80" exponent="1" castshadow="false"/>'
    wall = geom("box", (0.02, 2.5, 1.5), (BACK, 0.0, 0.7), (0.70, 0.71, 0.69))
    shelf = [
        geom("box", (0.12, 0.45, 0.02), (BACK - 0.14, 0.5, z), (0.50, 0.44, 0.38))
        for z in (0.15, 0.55, 0.95)
    ]
    door = geom("box", (0.01, 0.42, 1.1), (BACK - 0.02, -0.85, 0.35), (0.58, 0.60, 0.63))
    floor = geom("plane", (4.0, 4.0, 0.1), (0.0, 0.0, FLOOR), (0.36, 0.37, 0.38))
    return [lamp, window, wall, *shelf, door, floor]


def _table(geometry: CellGeometry, look: Appearance) -> list[str]:
    table = geometry.table
    length, width, thick = table.size
    top = geom(
        "box",
        (length / 2, width / 2, thick / 2),
        (table.x, table.y, -thick / 2),
        look.table,
        material="table",
    )
    things = [
        geom(
            "cylinder" if thing.round else "box",
            (thing.half[0], thing.half[2]) if thing.round else thing.half,
            thing.at,
            thing.colour,
            euler=(0.0, 0.0, thing.yaw),
        )
        for thing in look.things
    ]
    return [top, *things]


def _conveyor(geometry: CellGeometry) -> list[str]:
    """In frame conveyor: x with the belt, the belt's face at z = 0."""
    belt, frame = geometry.belt, geometry.conveyor
    start, end = belt.feeder - 0.03, belt.end - 0.005
    middle, half = (start + end) / 2, (end - start) / 2
    height = frame.z - 0.012
    rail = belt.width / 2 + 0.004
    parts = [
        box((half, belt.width / 2, 0.005), (middle, 0.0, -0.005), (0.22,) * 3, material="belt"),
        box((half, rail - 0.003, height / 2), (middle, 0.0, -0.012 - height / 2), STEEL),
        *(box((half, 0.003, 0.010), (middle, s * rail, -0.008), STEEL) for s in (-1, 1)),
        *(
            cylinder(0.0055, belt.width / 2, (x, 0.0, -0.0055), RUBBER, (math.pi / 2, 0.0, 0.0))
            for x in (start, end)
        ),
        box((0.008, 0.006, 0.016), (geometry.edge / 2, rail + 0.010, 0.010), DARK),
        box((0.020, 0.050, 0.050), (start - 0.020, 0.0, 0.020), BOX),
    ]
    return [body("conveyor", (frame.x, frame.y, frame.z), parts, yaw=frame.yaw)]


def _arm(geometry: CellGeometry, links: Links) -> list[str]:
    """The Magician: its parallelogram as joints that undo each other (fabric_bringup draws it so
    too)."""
    frame = geometry.arm
    rear, fore, tool = links.rear_arm, links.forearm, links.tool_x
    side = (math.pi / 2, 0.0, 0.0)
    cup = [
        cylinder(0.012, 0.018, (0.0, 0.0, 0.036), DARK),
        cylinder(0.006, 0.010, (0.0, 0.0, 0.012), STEEL),
        cylinder(0.009, 0.003, (0.0, 0.0, 0.003), RUBBER),
    ]
    tip = (0.0, links.tool_y, -links.tool_z)
    chain = body("arm_cup", tip, cup)
    chain = body("arm_tool", (tool, 0.0, 0.0), [chain], joint="0 0 1")
    wrist = [cylinder(0.017, 0.024, (0.0, 0.0, 0.0), DARK, side)]
    wrist += [box((tool / 2, 0.017, 0.009), (tool / 2, 0.0, 0.030), SHELL)]
    wrist += [box((0.014, 0.020, 0.016), (tool, 0.0, 0.048), DARK)]
    chain = body("arm_wrist", (fore, 0.0, 0.0), [*wrist, chain], joint="0 1 0")
    forearm = [capsule(0.015, (0.0, 0.0, 0.0), (fore, 0.0, 0.0), SHELL)]
    chain = body("arm_fore", (0.0, 0.0, 0.0), [*forearm, chain], joint="0 1 0")
    elbow = [cylinder(0.023, 0.030, (0.0, 0.0, 0.0), DARK, side)]
    chain = body("arm_elbow", (0.0, 0.0, rear), [*elbow, chain], joint="0 1 0")
    upper = [capsule(0.019, (0.0, y, 0.0), (0.0, y, rear), SHELL) for y in (-0.012, 0.012)]
    chain = body("arm_rear", (0.0, 0.0, 0.0), [*upper, chain], joint="0 1 0")
    turret = [
        cylinder(0.055, 0.035, (0.0, 0.0, -0.035), SHELL),
        cylinder(0.034, 0.042, (0.0, 0.0, 0.0), DARK, side),
        box((0.035, 0.040, 0.030), (-0.030, 0.0, 0.0), SHELL),
    ]
    chain = body("arm_turret", (0.0, 0.0, 0.0), [*turret, chain], joint="0 0 1")
    foot = (frame.z - 0.070) / 2
    base = [box((0.079, 0.079, foot), (0.0, 0.0, foot - frame.z), SHELL)]
    return [body("arm", (frame.x, frame.y, frame.z), [*base, chain], yaw=frame.yaw)]


def _trays(scenario: str, trays: Sequence[Tray]) -> str:
    """All trays of a scenario as one body that can be put away."""
    parts = [part for tray in trays for part in _tray(tray)]
    return body(f"trays_{scenario}", (0.0, 0.0, 0.0), parts, mocap=True)


def _tray(tray: Tray) -> list[str]:
    x, y, z = tray.floor
    colour = BOX if tray.owner == Container.OWNER_BELT else TRAY
    a, b = tray.size[0] / 2, tray.size[1] / 2
    wall = WALL / 2
    foot = (z - THICK) / 2
    parts = [
        box((a, b, THICK / 2), (x, y, z - THICK / 2), colour),
        *(box((THICK / 2, b, wall), (x + s * a, y, z + wall), colour) for s in (-1, 1)),
        *(box((a, THICK / 2, wall), (x, y + s * b, z + wall), colour) for s in (-1, 1)),
    ]
    if foot > 0.0:
        parts.append(box((0.8 * a, 0.8 * b, foot), (x, y, foot), STEEL))
    return parts


def _cubes(edge: float) -> list[str]:
    half = edge / 2
    part = geom("box", (half, half, half), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), name="cube{}")
    return [
        body(f"cube{i}", (0.0, 0.0, FLOOR - 1.0), [part.format(i)], mocap=True)
        for i in range(CUBES)
    ]


def _marker(dictionary: str, number: int) -> bytes:
    """A marker with a white rim of one module, as PNG. Raises ValueError for none such."""
    known = getattr(cv2.aruco, dictionary, None) if dictionary.startswith("DICT_") else None
    if known is None:
        raise ValueError(f"dictionary is {dictionary!r}; OpenCV has none of that name")
    words = cv2.aruco.getPredefinedDictionary(known)
    if not 0 <= number < len(words.bytesList):
        raise ValueError(f"marker {number} is not in {dictionary}: it has {len(words.bytesList)}")
    modules = words.markerSize + 2
    draw = getattr(cv2.aruco, "generateImageMarker", None) or cv2.aruco.drawMarker
    rim = 32
    picture = draw(words, number, modules * rim)
    framed = cv2.copyMakeBorder(picture, rim, rim, rim, rim, cv2.BORDER_CONSTANT, value=255)
    return _png(cv2.cvtColor(framed, cv2.COLOR_GRAY2RGB))


def _png(picture: np.ndarray) -> bytes:
    """(H, W, 3) uint8, red first, as a file."""
    written, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    assert written
    return data.tobytes()
