# SPDX-License-Identifier: BSD-3-Clause
"""The cell and the graph in step (docs/time.md): tick, tell, wait until nobody has work left."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from fabric_sim.cell import TICK, CellOutput, Stimulus

CALM = 0.5  # s without a change after which nothing is on its way any more
IDLE = 0.1  # s between looks at a graph without a task


class Stalled(RuntimeError):
    """Somebody did not answer in time; the message says who and what."""


class Output(Protocol):
    """What a tick brought."""

    def stimuli(self) -> list[Stimulus]:
        """Messages in their order, together what is handed on together."""


class Ticking(Protocol):
    """A cell, as the lockstep sees it."""

    @property
    def running(self) -> bool:
        """Whether a task lets time pass."""

    def step(self) -> Output:
        """Advance by one tick."""


class Graph(Protocol):
    """The other nodes, as the lockstep sees them."""

    @property
    def closed(self) -> bool:
        """True when the run is to end."""

    @property
    def ready(self) -> bool:
        """False while somebody at the keys has yet to sit down: time stands for the others too."""

    def wait(self, seconds: float) -> None:
        """Return when anything was heard, or after this wall time."""

    def missing(self) -> list[str]:
        """What is not ready yet."""

    def forgive_losses(self) -> None:
        """Do not wait for messages that were lost before everybody was there."""

    def outstanding(self) -> list[str]:
        """Who has work left."""

    def show(self, output: CellOutput | None) -> None:
        """Publish what nobody decides on; None while time stands."""

    def send(self, stimulus: Stimulus) -> None:
        """Publish messages that are counted."""


@dataclass(frozen=True)
class Pace:
    """How fast, and how long to wait for others; wall seconds."""

    speed: float  # times real time; 0 as fast as possible
    guard: float  # for work to be done
    startup_guard: float  # for everybody to be there


class Lockstep:
    """Runs the cell until the graph is closed."""

    def __init__(
        self, cell: Ticking, graph: Graph, pace: Pace, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._cell = cell
        self._graph = graph
        self._pace = pace
        self._clock = clock
        self._next = clock()

    def run(self) -> None:
        """Wait for everybody, then tick whenever a task runs. Raises Stalled."""
        self.get_ready()
        while not self._graph.closed:
            if self._cell.running and self._graph.ready:
                self.tick()
            else:
                self._graph.show(None)
                self._graph.wait(IDLE)

    def get_ready(self) -> None:
        """Wait until everybody is there and what was sent before has arrived. Raises Stalled."""
        self._until_none(self._graph.missing, self._pace.startup_guard, "cannot start")
        before, since = self._graph.outstanding(), self._clock()
        while not self._graph.closed and before and self._clock() - since < CALM:
            self._graph.wait(CALM)
            now = self._graph.outstanding()
            if now != before:
                before, since = now, self._clock()
        if not self._graph.closed:
            self._graph.forgive_losses()

    def tick(self) -> None:
        """One tick of the cell with all that it causes. Raises Stalled."""
        self._settle()
        if self._graph.closed or not self._cell.running:
            return
        output = self._cell.step()
        self._graph.show(output)
        for stimulus in output.stimuli():
            if self._graph.closed or not self._cell.running:
                return
            self._graph.send(stimulus)
            self._settle()
        self._keep_pace()

    def _settle(self) -> None:
        self._until_none(self._graph.outstanding, self._pace.guard, "does not go on")

    def _until_none(self, words: Callable[[], list[str]], guard: float, what: str) -> None:
        """Wait until there is nothing to name any more."""
        start = self._clock()
        left = words()
        while left and not self._graph.closed:
            waited = self._clock() - start
            if waited >= guard:
                raise Stalled(f"the simulation {what} after {guard:g} s: {'; '.join(left)}")
            self._graph.wait(guard - waited)
            left = words()

    def _keep_pace(self) -> None:
        """Wait until it is time for the next tick; time lost is not made up for."""
        if self._pace.speed == 0.0:
            return
        self._next = max(self._next + TICK / self._pace.speed, self._clock())
        while not self._graph.closed and self._clock() < self._next:
            self._graph.wait(self._next - self._clock())
