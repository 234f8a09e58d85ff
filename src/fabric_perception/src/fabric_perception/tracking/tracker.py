# SPDX-License-Identifier: BSD-3-Clause
"""Stage 4: which cube is which, from picture to picture and while somebody carries it.

A cube gets its number where it comes into the cell, on the belt, in the order of arrival. From
then on it is lost sight of only in three ways: something hides it (it stays where it is, or rides
on), somebody takes it (it goes where they go), or it falls off the belt. It is found again where
it is expected, in the carrier's grip, or lying where the carrier has passed.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from fabric_msgs.msg import Container
from fabric_perception.tracking.carriers import CUP, HAND, Carrier, Carriers, Signals
from fabric_perception.tracking.hand import HandTrack
from fabric_perception.tracking.measuring import Detection
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.sight import Sight
from fabric_perception.tracking.tracks import AT_SENSOR, CubeTrack
from fabric_perception.tracking.workspace import Workspace

Look = Callable[[Sequence[np.ndarray]], list[Sight]]
NEVER = 1e6  # cost of a pair that is impossible
IN_GRIP = {HAND: 0.05, CUP: 0.01}  # m, that a cube may move in a grip between two pictures
UNSENSED = {HAND: 2, CUP: 1}  # pictures in which the sensor misses a cube that was taken
PART_OF = 1.0  # edges from a cube in a container, within which a part of it is seen
STEADY = 0.7  # edges, within which a cube that lies in a container is measured
DOUBTS = 5  # pictures in a row in which the place of a cube in a container is empty
BIRTHPLACE = 3.0  # edges from the feeder, in which no cube turns up again
ANYWHERE = 0.3  # m, cost of finding a lost cube far from where it was
BESIDE_WAY = 0.02  # m beyond its reach beside a carrier's way, where a cube may be that it put down
EMPTY_HAND = (
    0.4  # s that a carried cube is out of view, after which it may be anywhere near the way
)
AWAY = 0.02  # m beyond its reach at which a carrier has left a cube
GRACE = 0.3  # s that a cube without a number may be out of view


class CubeTracker:
    """Tracks of the cubes of one task. tracks: all with a number, by number."""

    def __init__(self, workspace: Workspace, parameters: TrackingParameters) -> None:
        self._workspace, self._parameters = workspace, parameters
        self.reset()

    def reset(self) -> None:
        """A new task: forget every cube."""
        self.tracks: dict[int, CubeTrack] = {}
        self._unnamed: list[CubeTrack] = []
        self._empty: dict[int, int] = {}  # pictures in a row in which a container place is empty
        self.carriers = Carriers(self._workspace.edge, self._parameters)

    def step(
        self,
        t: float,
        cubes: list[Detection],
        hand: HandTrack | None,
        signals: Signals,
        look: Look,
    ) -> None:
        """Take the cubes seen at time t (s); `look` says what is seen at places without one."""
        self.carriers.move(t, hand, signals)
        tracks = [*self.tracks.values(), *self._unnamed]
        left = self._match(t, tracks, cubes, signals)
        missing = [track for track in self.tracks.values() if not track.measured]
        sights = look([track.position for track in missing])
        gone = self._explain(t, missing, sights, signals)
        left = self._find_carried(t, left)
        for track in gone:
            if not track.measured:
                self._lose(t, track)
        self._unnamed = [track for track in self._unnamed if track.age(t) <= GRACE]
        for cube in left:
            self._unnamed.append(CubeTrack(t, cube, self._workspace, self._parameters))
        self._name(t, signals)
        for track in self.tracks.values():
            self._follow(t, track, signals)

    # -- matching -------------------------------------------------------------------------------

    def _match(
        self, t: float, tracks: list[CubeTrack], cubes: list[Detection], signals: Signals
    ) -> list[Detection]:
        """Give tracks the cubes near where they are expected; return the cubes left over."""
        if not tracks:
            return cubes
        expected = np.array(
            [track.predict(t, self._carrier_of(track), signals) for track in tracks]
        )
        if not cubes:
            return self._overlook(tracks)
        seen = np.array([cube.position for cube in cubes])
        cost = np.linalg.norm(expected[:, None] - seen[None], axis=2)
        self._bring_near(tracks, expected, cubes, cost)
        gates = np.array([self._gate(track) for track in tracks])
        colours = np.array([track.colour for track in tracks])
        others = colours[:, None] != np.array([cube.colour for cube in cubes])
        # a cube with a number comes before one without
        cost[(cost > gates[:, None]) | others] = NEVER
        cost[len(self.tracks) :] += 0.01
        left = set(range(len(cubes)))
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if cost[row, column] < NEVER:
                track = tracks[row]
                track.take(t, cubes[column], self._carrier_of(track))
                left.discard(int(column))
        self._overlook(tracks)
        return [cubes[index] for index in sorted(left)]

    @staticmethod
    def _bring_near(
        tracks: list[CubeTrack], expected: np.ndarray, cubes: list[Detection], cost: np.ndarray
    ) -> None:
        """A cube without depth may be anywhere on its line when somebody carries it."""
        blind = [column for column, cube in enumerate(cubes) if cube.sight is not None]
        for row, track in enumerate(tracks):
            if track.carrier is not None:
                for column in blind:
                    place = cubes[column].near(expected[row]).position
                    cost[row, column] = np.linalg.norm(place - expected[row])

    def _overlook(self, tracks: list[CubeTrack]) -> list[Detection]:
        for track in tracks:
            if not track.measured:
                track.overlook()
        return []

    def _gate(self, track: CubeTrack) -> float:
        edge = self._workspace.edge
        if track.container is not None:
            return STEADY * edge
        if track.carrier is not None:
            return self._parameters.gate * edge + IN_GRIP[track.carrier]
        return self._parameters.gate * edge + min(3.0 * track.filter.spread, edge)

    def _carrier_of(self, track: CubeTrack) -> Carrier | None:
        return None if track.carrier is None else self.carriers.all[track.carrier]

    # -- cubes that are not where they were -----------------------------------------------------

    def _explain(
        self, t: float, missing: list[CubeTrack], sights: list[Sight], signals: Signals
    ) -> list[CubeTrack]:
        """Return the tracks that have left their place, which somebody may have taken."""
        gone = []
        for track, sight in zip(missing, sights, strict=True):
            if track.carrier is not None:
                continue
            empty = sight is Sight.EMPTY or self._sensor_is_free(track, signals)
            if track.container is not None:
                count = self._empty.get(track.number, 0) + 1 if empty else 0
                self._empty[track.number] = count
                empty = count >= DOUBTS and self._taker(t, track) is not None
            if empty:
                gone.append(track)
        return gone

    def _sensor_is_free(self, track: CubeTrack, signals: Signals) -> bool:
        """The infrared sensor knows first that the cube before it was taken."""
        if signals.at_pick_point is not False or signals.belt_speed != 0.0:
            return False
        along = self._workspace.along(track.position)[0]
        return abs(along) <= self._workspace.edge / 2 and bool(track.contacts)

    def _taken_from_sensor(self, track: CubeTrack, signals: Signals) -> Carrier | None:
        """Who holds a cube that the infrared sensor has seen and now misses.

        The cup is believed at once, for its robot must know; a hand may just have made the sensor
        chatter.
        """
        along = self._workspace.along(track.position)[0] / self._workspace.edge
        if signals.at_pick_point is None or not AT_SENSOR[0] <= along <= AT_SENSOR[1]:
            track.at_sensor, track.unsensed = False, 0
            return None
        track.at_sensor |= signals.at_pick_point
        track.unsensed = 0 if signals.at_pick_point else track.unsensed + 1
        if not track.at_sensor or track.unsensed == 0:
            return None
        taker = self.carriers.nearest(track.position)
        if taker is None or track.unsensed < UNSENSED[taker.name]:
            return None
        return taker

    def _find_carried(self, t: float, left: list[Detection]) -> list[Detection]:
        """Give cubes that are seen in a grip to tracks that are carried or have just gone."""
        unclaimed = []
        for cube in left:
            cube, carrier = self._grip_on(cube)
            if self._part_of_known(cube):
                continue
            track = None if carrier is None else self._track_in(t, carrier, cube)
            if track is None or carrier is None:
                unclaimed.append(cube)
                continue
            track.filter.reset(t, cube.position, cube.sigma, carrier.velocity)
            track.attach(carrier, seen_there=True)
            track.seen, track.measured = t, True
        return unclaimed

    def _grip_on(self, cube: Detection) -> tuple[Detection, Carrier | None]:
        """Who may hold a cube that is seen, and where it is then."""
        if cube.sight is None:
            return cube, self.carriers.nearest(cube.position, IN_GRIP)
        for carrier in self.carriers.all.values():
            if carrier.grip is not None:
                moved = cube.near(carrier.grip)
                if carrier.reaches(moved.position, IN_GRIP[carrier.name]):
                    return moved, carrier
        return cube, None

    def _part_of_known(self, cube: Detection) -> bool:
        """Whether it is a cube in a container, of which something hides the rest."""
        near = PART_OF * self._workspace.edge
        return any(
            track.container is not None
            and not track.measured
            and track.colour == cube.colour
            and float(np.linalg.norm(track.position - cube.position)) <= near
            for track in self.tracks.values()
        )

    def _track_in(self, t: float, carrier: Carrier, cube: Detection) -> CubeTrack | None:
        """The track that a cube in a carrier's grip belongs to."""
        able = [
            track
            for track in self.tracks.values()
            if track.colour == cube.colour and not track.measured and track.container is None
        ]
        held = [track for track in able if track.carrier == carrier.name]
        fresh = [track for track in able if self._taker(t, track) is carrier]
        return min(held or fresh, key=lambda track: -track.seen, default=None)

    def _taker(self, t: float, track: CubeTrack) -> Carrier | None:
        """Who was at the cube of late and has gone from its place since."""
        able = [
            carrier
            for carrier in self.carriers.all.values()
            if t - track.contacts.get(carrier.name, -np.inf) <= self._parameters.contact_memory
        ]
        return min(able, key=lambda c: -track.contacts[c.name], default=None)

    def _lose(self, t: float, track: CubeTrack) -> None:
        """The place of the track is seen empty: it was taken, it fell, or nobody knows."""
        taker = self._taker(t, track)
        if taker is not None:
            track.attach(taker, seen_there=False)
            return
        if track.missing is None:
            track.missing = t
        if self._fell(track):
            box = next(b for b in self._workspace.trays if b.owner == Container.OWNER_BELT)
            place = np.array(box.floor) + (0.0, 0.0, self._workspace.edge / 2)
            track.filter.reset(t, place, box.size[0] / 2, np.zeros(3))

    def _fell(self, track: CubeTrack) -> bool:
        """Whether the track ended at the end of the belt."""
        along, across = self._workspace.along(track.position)
        edge = self._workspace.edge
        near = self._workspace.end - 1.5 * edge <= along <= self._workspace.end + 2.0 * edge
        return bool(near and abs(across) <= self._workspace.width / 2)

    # -- cubes without a number -----------------------------------------------------------------

    def _name(self, t: float, signals: Signals) -> None:
        """Find out which cubes those without a number are; foremost on the belt first."""
        waiting = sorted(
            (track for track in self._unnamed if track.measured),
            key=lambda track: -self._workspace.along(track.position)[0],
        )
        held_up = False  # by one farther on that is not known yet
        for track in waiting:
            ripe = track.pictures >= self._parameters.birth_pictures
            known = self._recognise(t, track) if ripe else None
            if known is not None:
                self._turn_up(t, known, track)
            elif ripe and self._newcomer(track) and not held_up:
                track.number = len(self.tracks) + 1
                self.tracks[track.number] = track
            else:
                held_up |= self._on_belt(track)
                continue
            self._unnamed.remove(track)

    def _on_belt(self, track: CubeTrack) -> bool:
        x, y, _ = track.position
        return self._workspace.over_belt(x, y) and not track.lifted

    def _newcomer(self, track: CubeTrack) -> bool:
        if not self._on_belt(track):
            return False
        p = self._parameters
        late = track.pictures > p.birth_pictures + p.rest_pictures  # then it is not one put back
        return late or self._entering(track.position)

    def _recognise(self, t: float, found: CubeTrack) -> CubeTrack | None:
        costs = [
            (self._cost_of_finding(t, track, found), track)
            for track in self.tracks.values()
            if track.colour == found.colour and not track.measured and track.container is None
        ]
        cost, best = min(costs, key=lambda entry: entry[0], default=(NEVER, None))
        return best if cost < NEVER else None

    def _cost_of_finding(self, t: float, track: CubeTrack, found: CubeTrack) -> float:
        """How implausible it is, in m, that a cube found lying is the one of the track."""
        place = found.position
        if track.carrier is not None:
            carrier = self.carriers.all[track.carrier]
            beside = carrier.way_above(place)
            # an empty hand may have let go at the tips of its fingers
            slack = 2.0 if track.age(t) > EMPTY_HAND else 1.0
            near = beside <= slack * (carrier.reach + BESIDE_WAY)
            if self._put_down(found) and not carrier.reaches(place, AWAY) and near:
                return beside
        far = float(np.linalg.norm(place - track.position))
        if track.carrier is None and far <= 3.0 * self._workspace.edge:
            return far
        lost = track.carrier is None and track.missing is not None
        unseen = track.carrier is not None and self.carriers.all[track.carrier].grip is None
        if self._entering(place):
            return NEVER
        waited = track.age(t) > self._parameters.lost_after
        return ANYWHERE + far if (lost or unseen) and waited and self._put_down(found) else NEVER

    def _entering(self, place: np.ndarray) -> bool:
        """Whether a place (3,) is where new cubes come from."""
        along = self._workspace.along(place)[0]
        entering = along < self._workspace.feeder + BIRTHPLACE * self._workspace.edge
        return bool(entering and self._workspace.over_belt(place[0], place[1]))

    def _put_down(self, found: CubeTrack) -> bool:
        """Whether nobody holds a cube that was found: it lies, or rides on the belt."""
        return found.rests or (
            self._on_belt(found) and found.pictures > self._parameters.rest_pictures
        )

    def _turn_up(self, t: float, known: CubeTrack, found: CubeTrack) -> None:
        known.release(t)
        known.move_to(found)

    # -- what cubes do --------------------------------------------------------------------------

    def _follow(self, t: float, track: CubeTrack, signals: Signals) -> None:
        """Note who is at a cube, who lifts it and who has put it down."""
        place = track.position
        if track.carrier is None:
            for carrier in self.carriers.all.values():
                if carrier.reaches(place):
                    track.contacts[carrier.name] = t
            if track.container is not None:
                return
            taker = self._taken_from_sensor(track, signals)
            if taker is None and track.measured and track.lifted:
                taker = self.carriers.nearest(place)
            if taker is not None:
                track.attach(taker, seen_there=True)
            return
        carrier = self.carriers.all[track.carrier]
        track.held = (track.carrier, t)
        if track.measured and track.rests and not track.lifted:
            if carrier.distance(place) > carrier.reach + AWAY:
                track.release(t)
