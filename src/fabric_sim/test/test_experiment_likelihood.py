# SPDX-License-Identifier: BSD-3-Clause
"""The filter against every hidden path, and against how often the simulator does things."""

from collections import Counter
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from fabric_msgs.msg import Container
from fabric_sim.character import CORNERS, Character, named_generator
from fabric_sim.experiments.likelihood import Filter
from fabric_sim.experiments.modes import MODES
from fabric_sim.experiments.tables import Tables
from fabric_sim.experiments.trials import (
    GRASP,
    IDLE,
    LOOK,
    PERSON_SUCCEEDED,
    ROBOT_GRASP,
    ROBOT_IDLE,
    SYMBOLS,
    TICK,
    UNSEEN,
    WALK,
    WARN,
    Trial,
)
from fabric_sim.experiments.watching import Watching, survival, tick_distribution
from fabric_sim.sensing import load_sensing
from fabric_sim.worker import Worker
from fabric_sim.worker_events import RobotView, WorldView
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import Span, WorkerParameters

SENSING = load_sensing(Path(__file__).parents[1] / "config" / "sensing.yaml")
PARAMETERS = WorkerParameters.load()
LIBRARY = ModelLibrary(PARAMETERS.model)
WATCHING = Watching.of(SENSING)
SOMEBODY = Character(0.4, 0.3, 0.5, 0.2)
EXACT = replace(WATCHING, sensing=replace(SENSING, confusion=0.0), slip=0.0, stray_event=0.0)


def tables_of(scenario, watching=WATCHING, people=(SOMEBODY,)):
    return Tables(people, PARAMETERS, LIBRARY, watching, scenario)


def trial_of(symbols, scenario="inspection", robot=None, events=None):
    n = len(symbols)
    robot = np.full(n, ROBOT_IDLE) if robot is None else np.array(robot)
    events = np.zeros(n, dtype=int) if events is None else np.array(events)
    return Trial("p", 1, "r", scenario, np.array(symbols), robot, events, n, waits=False)


class EveryPath:
    """The likelihood of a trial as a sum over hidden paths, one by one; for one character."""

    def __init__(self, tables):
        self.t, self.layout = tables, tables.layout
        knows = tables.knows_at_first() if tables.sorting else None
        self.D = tables.durations(knows)[0]

    def begin(self, chances):
        """Every way to begin: (chance, appearance, ticks left)."""
        for v in np.flatnonzero(chances):
            start = self.layout.start[v]
            for r in range(self.layout.ticks[v]):
                if self.D[start + r] > 0.0:
                    yield chances[v] * self.D[start + r], v, r

    def likelihood(self, trial):
        self.trial = trial
        return sum(p * self.onwards(v, r, 0) for p, v, r in self.begin(self.t.start[0]))

    def onwards(self, v, r, tick):
        """P(what is seen from `tick` on), arrived at appearance v with r ticks left."""
        seen = self.seen(v, tick)
        if seen == 0.0 or tick + 1 == len(self.trial):
            return seen
        robot = self.trial.robot[tick - 1] if tick > 0 else ROBOT_IDLE  # 0.3 s late, a tick ago
        after = self.t.grasped if robot == ROBOT_GRASP else self.t.free
        arrivals = [(1.0, v, r - 1)] if r else self.begin(after[0, v])
        return seen * sum(p * self.noticed(*at, tick + 1) for p, *at in arrivals)

    def noticed(self, v, r, tick):
        """The person may notice the robot's grasp before `tick` is seen."""
        f = self.notice(v, tick)
        J = self.t.grasp[0, v]
        total = (1.0 - f * J.sum()) * self.onwards(v, r, tick)
        if f > 0.0 and J.sum() > 0.0:
            total += sum(p * self.onwards(*at, tick) for p, *at in self.begin(f * J))
        return total

    def notice(self, v, tick):
        grasps = [k for k in range(tick - 1) if self.trial.robot[k] == ROBOT_GRASP]
        if not grasps or self.trial.robot[tick - 2] != ROBOT_GRASP:
            return 0.0
        looks = MODES[self.layout.looks[v].mode].looks == LOOK
        span = self.layout.timing.late_reaction if looks else self.layout.timing.reaction
        age = tick - 2 - grasps[0]
        over = [self.over(span, (age + k + 0.5) * TICK) for k in (0, 1)]
        return 1.0 - over[1] / (over[0] if age else 1.0)

    @staticmethod
    def over(span, seconds):
        return float(survival(span, np.array(seconds), np.array(1.0)))

    def seen(self, v, tick):
        w, look = self.t.watching, self.layout.looks[v]
        same = look.shown == self.trial.symbols[tick]
        chance = (1.0 - w.slip) * same + w.slip / len(SYMBOLS)
        placed = MODES[look.mode].name.startswith(("placed", "early"))
        report = w.reported if placed else w.stray_event
        if self.trial.events[tick] == PERSON_SUCCEEDED:
            knows = self.t.knows_at_first()[0] if self.t.sorting else 1.0
            right = (1.0 - w.misjudged) * (knows + (1.0 - knows) / 3.0) + w.misjudged / 2.0
            return chance * report * right
        return chance * (1.0 - report)


@pytest.mark.parametrize(
    ("symbols", "scenario", "robot", "events"),
    [
        ([IDLE, IDLE, LOOK, LOOK], "inspection", None, None),
        ([LOOK, LOOK, LOOK, GRASP, GRASP], "inspection", None, None),
        ([IDLE, LOOK, IDLE, GRASP], "sorting", None, [0, 0, 0, PERSON_SUCCEEDED]),
        ([LOOK, IDLE, LOOK, IDLE], "sorting", None, None),
        ([IDLE, IDLE, WARN, WARN], "inspection", [ROBOT_GRASP] * 4, None),
        ([LOOK, LOOK, LOOK, WARN], "sorting", [ROBOT_GRASP] * 4, None),
    ],
)
def test_the_filter_sums_over_every_hidden_path(symbols, scenario, robot, events):
    tables = tables_of(scenario)
    trial = trial_of(symbols, scenario, robot, events)
    found = float(Filter(tables).run(trial).total[0])
    assert found == pytest.approx(np.log(EveryPath(tables).likelihood(trial)), abs=1e-9)


def test_a_tick_that_was_not_seen_sums_over_what_might_have_been_seen():
    run = Filter(tables_of("inspection")).run
    whole = run(trial_of([IDLE, UNSEEN, GRASP])).total[0]
    parts = [run(trial_of([IDLE, symbol, GRASP])).total[0] for symbol in range(len(SYMBOLS))]
    assert whole == pytest.approx(np.logaddexp.reduce(parts))


def test_the_chances_of_all_that_can_be_seen_sum_to_one():
    run = Filter(tables_of("inspection", replace(WATCHING, stray_event=0.0))).run
    every = product(range(len(SYMBOLS)), repeat=3)
    total = sum(float(np.exp(run(trial_of(symbols)).total[0])) for symbols in every)
    assert total == pytest.approx(1.0, abs=1e-9)


def test_rows_of_the_tables_are_chances_for_random_characters():
    rng = np.random.default_rng(101)
    people = [Character(*rng.random(4)) for _ in range(40)] + list(CORNERS.values())
    for scenario in ("inspection", "sorting"):
        tables = tables_of(scenario, people=people)
        for P in (tables.free, tables.grasped):
            assert P.min() >= 0.0
            assert np.allclose(P.sum(axis=2), 1.0)
        for J in (tables.grasp, tables.planning, tables.point):
            assert J.min() >= 0.0
            assert J.sum(axis=2).max() <= 1.0 + 1e-12
        assert np.allclose(tables.start.sum(axis=1), 1.0)
        D = tables.durations(tables.knows_at_first())
        assert np.allclose(np.add.reduceat(D, tables.layout.start, axis=1), 1.0)


def test_ticks_of_a_duration_have_the_mean_of_what_the_worker_draws():
    span = Span(2.0, 0.3, 1.0, 4.0)
    rng = np.random.default_rng(102)
    drawn = np.mean([span.draw(rng, 1.2) for _ in range(20000)])
    P = tick_distribution(span, np.array([1.2]), 14)[0]
    assert (P * np.arange(1, 15)).sum() * TICK == pytest.approx(drawn, abs=0.02)


def test_the_belief_after_a_trial_is_over_the_states_of_the_worker():
    filtered = Filter(tables_of("inspection", people=list(CORNERS.values())))
    filtered.run(trial_of([IDLE] * 4 + [WARN] * 4, robot=[ROBOT_GRASP] * 8))
    belief = filtered.states()
    assert belief.shape == (16, 12)
    assert np.allclose(belief.sum(axis=1), 1.0)
    assert (belief.argmax(axis=1) == 7).all()  # warns_the_robot


# -- against the simulator ------------------------------------------------------------------------

SIGHT = {"idle": IDLE, "grasp": GRASP, "look_around": LOOK, "warn": WARN, "walk_away": WALK}


def looks_of(person, number, times, robot):
    """What an ideal camera sees of a worker at some times, in s; `robot` acts from the start."""
    worker = Worker(person, named_generator(101, "worker", number), PARAMETERS, LIBRARY)
    worker.start_task(0.0, "inspection", named_generator(101, "task", number))
    worker.start_subtask(0.0)
    seen = []
    for tick in range(int(times[-1] / 0.05) + 1):
        worker.step(tick * 0.05, robot, WorldView())
        if any(abs(tick * 0.05 - t) < 1e-6 for t in times):
            seen.append(LOOK if worker.looking_around else SIGHT[worker.activity])
    return tuple(seen)


@pytest.mark.parametrize("person", ["0.4,0.3,0.5,0.2", "0.9,0.8,0.9,0.6"])
def test_the_likelihood_is_how_often_the_simulator_does_it(person):
    # a first piece begins anywhere in the tick before the first one: half a tick early on average
    character, ticks, n = Character.parse(person), (2, 6, 11), 6000
    times = tuple(tick * TICK + TICK / 2.0 for tick in ticks)
    seen = Counter(looks_of(character, k, times, RobotView()) for k in range(n))
    run = Filter(tables_of("inspection", EXACT, (character,))).run
    for symbols, count in seen.most_common(8):
        grid = np.full(ticks[-1] + 1, UNSEEN)
        grid[list(ticks)] = symbols
        chance = float(np.exp(run(trial_of(grid)).total[0]))
        assert count / n == pytest.approx(chance, abs=0.025), symbols


def test_a_grasping_robot_is_warned_as_often_as_in_the_simulator():
    person, times, n = Character(0.5, 0.6, 0.6, 0.3), (3.0,), 6000
    robot = RobotView(current=3, phase=1)
    seen = Counter(looks_of(person, k, times, robot) for k in range(n))
    watching = replace(EXACT, sensing=replace(EXACT.sensing, delay=(0.0, 0.0)))
    run = Filter(tables_of("inspection", watching, (person,))).run
    grid = np.full(7, UNSEEN)
    grid[-1] = WARN
    chance = float(np.exp(run(trial_of(grid, robot=[ROBOT_GRASP] * 7)).total[0]))
    assert seen[(WARN,)] / n == pytest.approx(chance, abs=0.03)


def test_tray_owner_of_the_messages_is_the_one_whose_settling_counts():
    assert Watching.of(SENSING).report == sum(SENSING.settle[Container.OWNER_PERSON]) / 2.0
