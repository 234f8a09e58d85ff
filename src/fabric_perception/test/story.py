# SPDX-License-Identifier: BSD-3-Clause
"""A small world told picture by picture: cubes on a belt, a hand and a suction cup that move."""

import numpy as np
from drawn import GREY, Painter, camera, palette, workspace

from fabric_msgs.settings import settings_from
from fabric_perception.tracking.carriers import Signals
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.pipeline import Tracking

PERIOD = 0.1  # s between two pictures
REST = np.array([0.62, 0.20, 0.06])
HOME = np.array([0.10, 0.0, 0.22])
SPEED = 0.6  # m/s of hand and cup
BELT = 0.08  # m/s
GRIP = np.array([-0.055, 0.0, -0.020])  # from the middle of the glove to a cube at the fingertips


class Story:
    """Draws and tracks. cubes: [colour, (3,) place, holder]; seen: what the tracker said last."""

    def __init__(self, scenario="sorting", parameters=None, signals=True, **looks):
        self.workspace, self.camera = workspace(scenario), camera()
        values = settings_from(TrackingParameters, parameters or {})
        self.tracking = Tracking(self.camera, self.workspace, palette(), values)
        self.painter = Painter(self.camera, self.workspace, seed=101)
        self.looks = {"noise": 3.0, "blur": 0.6, "holes": 0.01, "depth_noise": 0.0012} | looks
        self.signals = signals
        self.cubes, self.extras, self.deposits, self.history = [], [], [], []
        self.hand, self.cup = REST.copy(), HOME.copy()
        self.t, self.belt, self.hidden, self.seen = 0.0, 0.0, False, None

    # -- what happens ---------------------------------------------------------------------------

    def put(self, colour, along):
        """Put a cube on the belt; returns its index."""
        place = self.workspace.conveyor.to_cell(np.array([along, 0.0, self.workspace.edge / 2]))
        self.cubes.append([colour, place, None])
        return len(self.cubes) - 1

    def wait(self, pictures):
        """Let so many pictures pass."""
        for _ in range(pictures):
            self._picture()
        return self

    def reach(self, place, carry=None):
        """Move the hand to a place, pictures and all; `carry` is a cube it holds."""
        return self._go("hand", place, carry, GRIP)

    def lower(self, place, carry=None):
        """Move the cup so that a cube at it is at a place."""
        up = np.array([0.0, 0.0, self.workspace.edge / 2])
        return self._go("cup", np.asarray(place) + up, carry, -up)

    def run_belt(self, way, signalled=True):
        """Run the belt for a way in m."""
        for _ in range(round(way / BELT / PERIOD)):
            self.belt = BELT
            for cube in self.cubes:
                if cube[2] is None and abs(cube[1][2] - 0.1345) < 0.001:
                    cube[1] = cube[1] + (0.0, BELT * PERIOD, 0.0)
            self._picture()
        self.belt = 0.0
        return self

    def grip_of(self, place):
        """Where the hand has to be to hold a cube at a place."""
        return np.asarray(place) - GRIP

    def carry_to(self, index, place):
        """Take a cube with the hand, carry it in a bow and put it down at a place."""
        start = self.cubes[index][1]
        over = (start + place) / 2 + (0.0, 0.0, 0.08)
        self.reach(self.grip_of(start)).reach(self.grip_of(over), index)
        self.reach(self.grip_of(place), index)
        self.cubes[index][1] = np.asarray(place, dtype=float)
        return self.wait(1).reach(REST)

    def lift_to(self, index, place):
        """Take a cube with the cup, carry it over and let it fall to a place."""
        start = self.cubes[index][1]
        above = np.array([0.0, 0.0, 0.06])
        self.lower(start + above).lower(start).wait(2).lower(start + above, index)
        self.lower(np.asarray(place) + (0.0, 0.0, 0.03), index)
        self.cubes[index][1] = np.asarray(place, dtype=float)
        return self.wait(2).lower(np.asarray(place) + above + (0, 0, 0.04)).lower(HOME)

    # -- what is seen ---------------------------------------------------------------------------

    def cube(self, number):
        """The cube of a number as seen last, or None."""
        return next((cube for cube in self.seen.cubes if cube.id == number), None)

    def wheres(self, number):
        """Cube.WHERE_* of a cube in every picture, repeats left out."""
        told = [cube.where for seen in self.history for cube in seen.cubes if cube.id == number]
        return [w for i, w in enumerate(told) if i == 0 or w != told[i - 1]]

    def step(self, tray):
        """A load cell tells of a cube."""
        self.deposits += self.tracking.on_load_step(tray, self.t)

    def _go(self, who, place, carry, grip):
        start, place = getattr(self, who).copy(), np.asarray(place, dtype=float)
        count = max(1, int(np.ceil(np.linalg.norm(place - start) / SPEED / PERIOD)))
        for k in range(1, count + 1):
            s = k / count
            setattr(self, who, start + (3 * s**2 - 2 * s**3) * (place - start))
            if carry is not None:
                self.cubes[carry][1] = getattr(self, who) + grip
            self._picture(carry)
        return self

    def _picture(self, carried=None):
        self.t = round(self.t + PERIOD, 6)
        painter = self.painter.clear()
        for colour, place, _ in self.cubes:
            painter.cube(colour, place)
        for middle, size, colour in self.extras:
            painter.box(middle, size, colour)
        if not self.hidden:
            painter.glove(self.hand)
        painter.box(self.cup + (0, 0, 0.03), (0.02, 0.02, 0.06), GREY)
        painter.box(self.cup + (0, 0, 0.08), (0.06, 0.06, 0.04), (220, 220, 220))
        painter.box((self.cup + (0, 0, 0.08) + HOME) / 2, (0.05, 0.05, 0.04), (220, 220, 220))
        signals = Signals(cup=self.cup.copy())
        if self.signals:
            waiting = any(abs(c[1][1] - 0.035) < 0.013 and c[1][2] < 0.14 for c in self.cubes)
            signals = Signals(self.cup.copy(), self.belt, waiting)
        self.seen = self.tracking.step(self.t, *painter.picture(**self.looks), signals)
        self.deposits += self.seen.deposits
        self.history.append(self.seen)
