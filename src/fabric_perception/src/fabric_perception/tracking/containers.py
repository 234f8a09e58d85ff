# SPDX-License-Identifier: BSD-3-Clause
"""Stage 5: which cube entered which container, by whom; each event exactly once.

A person's trays stand on load cells: their step says when, the tracks say which cube. What the
robot's trays and the box of the belt hold is seen. A cube that is seen to lie in a person's tray
counts without a step after a while, so that a load cell that fails costs time, not a cube.
"""

from typing import NamedTuple

from fabric_msgs.msg import Container
from fabric_perception.tracking.carriers import HAND, OWNER_OF
from fabric_perception.tracking.parameters import TrackingParameters
from fabric_perception.tracking.tracks import CubeTrack
from fabric_perception.tracking.workspace import Tray, Workspace

HELD_OF_LATE = 5.0  # s; who held a cube so recently has put it where it is
SETTLING = 10.0  # s, in which a step may come for a cube that counted without one


class Deposit(NamedTuple):
    """A cube entered a container.

    t: s, when it was known. cube: its number. colour: Cube.COLOUR_*. tray: id of the container.
    by: Container.OWNER_* of who put it there. weighed: a load cell told of it.
    """

    t: float
    cube: int
    colour: int
    tray: int
    by: int
    weighed: bool


class _Step(NamedTuple):
    tray: int
    t: float


class Containers:
    """Contents of all containers. contents: cube numbers in order of arrival, by container id.

    sequence: number of changes so far. unexplained: steps of load cells without a cube.
    """

    def __init__(self, workspace: Workspace, parameters: TrackingParameters) -> None:
        self._workspace, self._parameters = workspace, parameters
        self.sequence = 0
        self.reset()

    def reset(self) -> None:
        """A new task: all containers are empty."""
        self.contents: dict[int, list[int]] = {tray.id: [] for tray in self._workspace.trays}
        self.colours: dict[int, int] = {}
        self.unexplained = 0
        self._last: dict[int, int] = {}  # container that a cube counted in, by cube
        self._steps: list[_Step] = []
        self._credit: list[_Step] = []  # cubes that counted before their step
        self._lying: dict[int, tuple[int, float]] = {}  # container and since when, by cube
        self._over: dict[tuple[int, int], float] = {}  # when a hand held a cube over a container
        self.sequence += 1

    def step(self, tray: int, t: float, cubes: int = 1) -> None:
        """A load cell tells at time t (s) that so many cubes more lie in a person's tray.

        Cubes that are taken out again before anybody knew which they were are forgotten. Raises
        ValueError for a container that has no load cell.
        """
        known = [x.id for x in self._workspace.trays if x.owner == Container.OWNER_PERSON]
        if tray not in known:
            raise ValueError(f"container {tray} has no load cell; {known} have")
        for _ in range(cubes):
            self._step_up(tray, t)
        for _ in range(-cubes):
            waiting = [step for step in self._steps if step.tray == tray]
            if waiting:
                self._steps.remove(waiting[-1])

    def _step_up(self, tray: int, t: float) -> None:
        for credit in self._credit:
            if credit.tray == tray and t - credit.t <= SETTLING:
                self._credit.remove(credit)
                return
        self._steps.append(_Step(tray, t))

    def update(self, t: float, tracks: dict[int, CubeTrack]) -> list[Deposit]:
        """Return what entered containers up to time t (s), given the cubes by number."""
        self._remove_taken(tracks)
        for track in tracks.values():
            self._note(t, track)
        deposits = [
            self._enter(t, tracks[number], tray, weighed=False)
            for number, tray in self._seen_to_lie(t, tracks)
        ]
        for step in list(self._steps):
            deposits += self._explain(t, step, tracks)
        return [deposit for deposit in deposits if deposit is not None]

    # -- what is where --------------------------------------------------------------------------

    def _remove_taken(self, tracks: dict[int, CubeTrack]) -> None:
        """A cube that somebody carries is in no container."""
        for numbers in self.contents.values():
            for number in list(numbers):
                if number in tracks and tracks[number].carrier is not None:
                    numbers.remove(number)
                    self.sequence += 1

    def _note(self, t: float, track: CubeTrack) -> None:
        """Remember what the track does at a container."""
        tray = track.tray
        if tray is None or track.container is not None:
            self._lying.pop(track.number, None)
            return
        if track.carrier == HAND:
            self._over[track.number, tray.id] = t
        if track.carrier is not None or not (track.rests or track.missing is not None):
            self._lying.pop(track.number, None)
            return
        if self._lying.get(track.number, (None,))[0] != tray.id:
            self._lying[track.number] = (tray.id, t)

    def _seen_to_lie(self, t: float, tracks: dict[int, CubeTrack]) -> list[tuple[int, Tray]]:
        found = []
        for number, (tray_id, since) in self._lying.items():
            tray = self._tray(tray_id)
            weighed = tray.owner == Container.OWNER_PERSON
            wait = self._parameters.unweighed_after if weighed else 0.0
            if tracks[number].missing is not None:  # fell off the belt; the box hides it
                wait = max(wait, self._parameters.lost_after)
            if t - since >= wait:
                found.append((number, tray))
        return sorted(found)

    def _explain(self, t: float, step: _Step, tracks: dict[int, CubeTrack]) -> list[Deposit | None]:
        """Find the cube that a load cell has told of; drop the step when none turns up."""
        number = self._cube_of(step, tracks)
        if number is None:
            if t - step.t > self._parameters.step_patience:
                self._steps.remove(step)
                self.unexplained += 1
            return []
        self._steps.remove(step)
        track, tray = tracks[number], self._tray(step.tray)
        if track.carrier is not None:
            track.release(t)
            track.place_in(t, tray)
        return [self._enter(t, track, tray, weighed=True)]

    def _cube_of(self, step: _Step, tracks: dict[int, CubeTrack]) -> int | None:
        """The cube that lies in the tray longest; else the one held over it last."""
        lying = [
            (since, number)
            for number, (tray, since) in self._lying.items()
            if tray == step.tray and tracks[number].missing is None
        ]
        if lying:
            return min(lying)[1]
        held = [
            (when, number)
            for (number, tray), when in self._over.items()
            if tray == step.tray
            and tracks[number].carrier == HAND
            and step.t - when <= self._parameters.step_delay
        ]
        return max(held)[1] if held else None

    def _enter(self, t: float, track: CubeTrack, tray: Tray, weighed: bool) -> Deposit | None:
        """The cube counts in the container; None when it did before it was lifted."""
        for numbers in self.contents.values():
            if track.number in numbers:
                numbers.remove(track.number)
        self.contents[tray.id].append(track.number)
        self.colours[track.number] = track.colour
        self.sequence += 1
        track.container = tray
        track.missing = None
        self._lying.pop(track.number, None)
        self._over = {key: when for key, when in self._over.items() if key[0] != track.number}
        if tray.owner == Container.OWNER_PERSON and not weighed:
            self._credit.append(_Step(tray.id, t))
        again = self._last.get(track.number) == tray.id
        self._last[track.number] = tray.id
        if again:
            return None
        return Deposit(t, track.number, track.colour, tray.id, _by(t, track), weighed)

    def _tray(self, number: int) -> Tray:
        return next(tray for tray in self._workspace.trays if tray.id == number)


def _by(t: float, track: CubeTrack) -> int:
    """Who put the cube where it is."""
    if track.held is not None and t - track.held[1] <= HELD_OF_LATE:
        return OWNER_OF[track.held[0]]
    return Container.OWNER_BELT
