# SPDX-License-Identifier: BSD-3-Clause
"""A simulated person's hand and head as a camera sees them: smooth, human, each person in a way
of their own.

    person = PersonMotion(geometry, manner_of(seed, 1), named_generator(seed, "motion", 1))
    person.tell(t, intent)      # every tick: what the worker model wants
    pose = person.pose(t)       # at any time since, as often as wanted
"""

from __future__ import annotations

import enum
import math
from typing import NamedTuple

import numpy as np

from fabric_msgs.msg import HumanActivity
from fabric_sim.camera.hand import HandPlan
from fabric_sim.camera.head import HeadPlan
from fabric_sim.camera.manner import Manner
from fabric_sim.camera.trajectory import Track, Wobble
from fabric_sim.geometry import CellGeometry, Point
from fabric_sim.sensing import Behaviour

WALK_TIME = 1.6  # s for a metre, at a pace of 1
LEAN = 0.10  # of the way of the hand that the head goes along
QUICKEST_WALK = 0.5  # s
UNHURRIED = 0.7  # of the time for leaving that is spent on walking away


class Phase(enum.Enum):
    """What the hand is about."""

    REST = "rest"
    REACH = "reach"
    CARRY = "carry"
    RETREAT = "retreat"
    STOP = "stop"
    AWAY = "away"


class Intent(NamedTuple):
    """What the worker wants at one moment.

    goal: in cell, m: where the cube in the hand goes, while it is known. deadline: s, when the
    present piece of action ends. episode: number of the grasp or warning.
    """

    behaviour: Behaviour = Behaviour()
    walking: bool = False
    holding: bool = False
    goal: Point | None = None
    deadline: float = math.inf
    episode: int = 0


class PersonPose(NamedTuple):
    """Where the person is at one moment; all in frame cell, m and rad.

    hand: (3,), middle of the glove. stop: 0 to 1, how far the hand is turned up against the robot.
    shoulder: (3,). head: (3,), middle of the head. yaw: of the head about z, 0 facing the robot's
    base, positive to the person's left. pitch: positive looks down. base: (3,), under the chest.
    """

    hand: np.ndarray
    stop: float
    shoulder: np.ndarray
    head: np.ndarray
    yaw: float
    pitch: float
    base: np.ndarray


class PersonMotion:
    """One person in motion. Ask `pose` only for times since the last `tell`."""

    def __init__(
        self, geometry: CellGeometry, manner: Manner, rng: np.random.Generator, t: float = 0.0
    ) -> None:
        """geometry: where things are. rng: decides pauses, corrections, fidgets. t: s."""
        self._frame, self._body = geometry.person, geometry.body
        self._manner = manner
        self._sway = Wobble(rng, manner.sway, (0.08, 0.5))
        self._hand = HandPlan(geometry, manner, rng)
        self._head = HeadPlan(manner, rng)
        self._walk = Track((0.0, 0.0, 0.0))
        self.phase = Phase.REST
        self._intent = Intent()
        self._hand.begin_rest(t)

    def tell(self, t: float, intent: Intent) -> None:
        """Say at time t (s), not decreasing, what the worker wants from now on."""
        before, self._intent = self._intent, intent
        phase = self._phase_of(before, intent)
        if phase is not self.phase:
            self.phase = phase
            self._begin(t, intent)
        elif phase is Phase.CARRY and (intent.goal, intent.deadline) != self._carries(before):
            self._hand.begin_carry(t, intent.goal, intent.deadline, lifted=True)
        else:
            self._hand.go_on(t)
        self._step_aside(t, intent)
        self._head.tell(t, intent.behaviour.looking_around, phase is Phase.STOP)

    def pose(self, t: float) -> PersonPose:
        """Where everything is at time t (s)."""
        walked, sway = self._walk.at(t).p, self._sway.at(t)
        hand = self._hand.at(t)
        lean = LEAN * (hand - self._hand.home)
        head = np.array(self._body.head) + lean * (1.0, 1.0, 0.3) + 2.0 * sway
        yaw, pitch = self._head.at(t, hand - np.array(self._body.head))
        shoulder = np.array(self._body.shoulder) + 0.8 * lean * (1.0, 1.0, 0.0) + sway
        here = (hand + sway, shoulder, head, sway)
        places = [self._to_cell(place + walked) for place in here]
        return PersonPose(places[0], self._hand.raised(t), *places[1:3], yaw, pitch, places[3])

    # -- inside ---------------------------------------------------------------------------------

    def _phase_of(self, before: Intent, now: Intent) -> Phase:
        behaviour = now.behaviour
        if now.walking or not behaviour.present:
            return Phase.AWAY
        if behaviour.activity == HumanActivity.WARN:
            return Phase.STOP
        if now.holding:
            return Phase.CARRY
        if behaviour.activity != HumanActivity.GRASP:
            return Phase.REST
        placed = before.holding or self.phase is Phase.RETREAT
        return Phase.RETREAT if placed and before.episode == now.episode else Phase.REACH

    def _begin(self, t: float, intent: Intent) -> None:
        if self.phase is Phase.REACH:
            self._hand.begin_reach(t, intent.deadline)
        elif self.phase is Phase.CARRY:
            self._hand.begin_carry(t, intent.goal, intent.deadline, lifted=False)
        elif self.phase is Phase.STOP:
            self._hand.begin_stop(t)
        elif self.phase is Phase.AWAY:
            self._hand.begin_hanging(t)
        else:
            self._hand.begin_rest(t, intent.deadline if self.phase is Phase.RETREAT else math.inf)

    @staticmethod
    def _carries(intent: Intent) -> tuple[Point | None, float]:
        return intent.goal, intent.deadline

    def _step_aside(self, t: float, intent: Intent) -> None:
        goal = self._body.away if self.phase is Phase.AWAY else Point(0.0, 0.0, 0.0)
        if tuple(self._walk.end) == tuple(goal):
            return
        way = float(np.linalg.norm(self._walk.at(t).p - np.array(goal)))
        time = 0.4 + WALK_TIME * way / self._manner.pace
        if intent.walking and intent.deadline < math.inf:  # nobody hurries into a break
            time = max(time, UNHURRIED * (intent.deadline - t))
        elif self.phase is Phase.REACH:  # back from a break and at work at once
            time = max(QUICKEST_WALK, min(time, 0.8 * (intent.deadline - t)))
        self._walk.go(t, goal, time)

    def _to_cell(self, place: np.ndarray) -> np.ndarray:
        return np.array(self._frame.to_cell(Point(*place)))
