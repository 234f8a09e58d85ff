# SPDX-License-Identifier: BSD-3-Clause
"""Learns how people answer take-overs from simulated people, and writes config/take_overs.yaml.

    python3 -m fabric_sim.experiments.take_overs_fit [people:=200] [out:=FILE]

Each person is a random point of the character cube and sorts twice beside the proactive robot,
twice beside the reactive one and twice beside one that grasps at any moment, as recorded robots
may; all is recorded as a real person would be. Maximum of the likelihood of their answers, each
given the answers before it, with a normal prior of standard deviation 1 on the states' log-odds;
and a logistic regression on their dials. Also prints how well people who were left out are
predicted.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_expit
from tqdm import tqdm

from fabric_planner import AlphaVectors
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_loop import Files, RunSetup
from fabric_sim.character import named_generator
from fabric_sim.experiments.recorder import CuriousDecider, RecordedRun
from fabric_sim.experiments.take_overs_belief import Habits, History, TypeStateModel
from fabric_sim.experiments.take_overs_read import SCENARIO, Folder, read_folder
from fabric_sim.experiments.take_overs_score import auc
from fabric_sim.experiments.take_overs_watch import Models, watch_all
from fabric_sim.experiments.trials import write_rows
from fabric_sim.staff import Staff

PEOPLE = 200
CURIOUS = "curious"  # the robot that tries everything
SHIFTS = (("proactive", 2), ("reactive", 2), (CURIOUS, 2))  # robot, tasks
PERSON = "person"  # file names begin with it, then comes the number
FIRST_SEED, SEEDS = 101, 99  # development seeds; those of reports are never used
STATE_PRIOR, DIAL_PRIOR = 1.0, 2.0  # standard deviations
HEAD = """\
# SPDX-License-Identifier: BSD-3-Clause
# How people answer take-overs, learnt from simulated people alone; written by
# python3 -m fabric_sim.experiments.take_overs_fit. Log-odds of accepting; docs/replay.md explains.
"""


def simulate(folder: Path, people: int, files: Files) -> Folder:
    """Record `people` random people into a folder and read it back."""
    solved = {robot: files.solve(robot, SCENARIO) for robot, _ in SHIFTS if robot != CURIOUS}
    for number in tqdm(range(people), desc="people", leave=False):
        _record(folder, number, files, solved)
    return read_folder(folder)


def dials_of(number: int) -> np.ndarray:
    """(4,): a random point of the character cube."""
    seed = FIRST_SEED + number % SEEDS
    return named_generator(seed, "people who are taken over", number // SEEDS).random(4)


def _record(folder: Path, number: int, files: Files, solved: dict[str, AlphaVectors]) -> None:
    seed = FIRST_SEED + number % SEEDS
    dials = ",".join(f"{value:.3f}" for value in dials_of(number))
    staff, task = Staff(dials, seed), 0
    for robot, tasks in SHIFTS:
        decider = _decider(robot, seed, files, solved)
        run = RecordedRun(RunSetup(SCENARIO, dials, robot, seed), staff=staff, decider=decider)
        for _ in range(tasks):
            task += 1
            write_rows(folder / f"{PERSON}{number}_task{task}_{robot}.csv", run.record_task())


def _decider(
    robot: str, seed: int, files: Files, solved: dict[str, AlphaVectors]
) -> AgentDecider | CuriousDecider:
    if robot == CURIOUS:
        agent = files.agent(files.model("none", SCENARIO))
        return CuriousDecider(agent, named_generator(seed, CURIOUS))
    return AgentDecider(files.offline_agent(files.model(robot, SCENARIO), solved[robot]))


class Fit:
    """Maximum a posteriori of the numbers of Habits."""

    def __init__(self, states: Sequence[str], types: Sequence[str]) -> None:
        self._states, self._types = list(states), list(types)

    def model(self, v: np.ndarray, known: np.ndarray) -> TypeStateModel:
        """The model of a parameter vector (4 + n_states,) and of the known types' numbers (5,)."""
        return TypeStateModel(self.habits(v, known), self._states, self._types)

    def habits(self, v: np.ndarray, known: np.ndarray) -> Habits:
        """The numbers as Habits."""
        states = dict(zip(self._states, v[4:].tolist(), strict=True))
        return Habits(
            mean=float(v[0]),
            spread=float(np.exp(v[1])),
            warning=float(v[2]),
            reluctance=float(v[3]),
            states=states,
            known=float(known[0]),
            dials=tuple(known[1:].tolist()),
        )

    def cost(self, v: np.ndarray, people: Sequence[History]) -> float:
        """Minus the log posterior, nats, up to a constant."""
        model = self.model(v, np.zeros(5))
        prior = 0.5 * (v[4:] ** 2).sum() / STATE_PRIOR**2
        return prior - sum(model.log_likelihood(history) for history in people)

    def run(self, people: Sequence[History]) -> np.ndarray:
        """Return the best parameter vector for these people."""
        start = np.zeros(4 + len(self._states))
        start[2] = -3.0
        return minimize(self.cost, start, args=(people,), method="L-BFGS-B").x


def by_dials(people: Sequence[History], dials: np.ndarray) -> np.ndarray:
    """(5,): intercept and slopes of the answers' log-odds on dials (n_people, 4) minus 1/2."""
    counts = [len(history.accepted) for history in people]
    x = np.column_stack((np.ones(sum(counts)), np.repeat(dials - 0.5, counts, axis=0)))
    signed = x * np.where(np.concatenate([h.accepted for h in people]) > 0.0, 1.0, -1.0)[:, None]

    def cost(w: np.ndarray) -> float:
        return float(0.5 * (w[1:] ** 2).sum() / DIAL_PRIOR**2 - log_expit(signed @ w).sum())

    return minimize(cost, np.zeros(5), method="BFGS").x


def left_out(fit: Fit, people: Sequence[History], dials: np.ndarray) -> dict[str, float]:
    """AUC of either half of the people, predicted by what the other half taught."""
    truth: list[float] = []
    chances: dict[str, list[float]] = {"together": [], "state": [], "type": [], "known_types": []}
    for other, half in ((1, 0), (0, 1)):
        taught = people[other::2]
        model = fit.model(fit.run(taught), by_dials(taught, dials[other::2]))
        for history in people[half::2]:
            truth += history.accepted.tolist()
            predictions = model.predict(history)
            for name, values in chances.items():
                values += getattr(predictions, name).tolist()
    return {name: auc(values, truth) for name, values in chances.items()}


def _rounded(habits: Habits) -> Habits:
    """Three digits are more than the simulated people settle."""
    states = {name: round(value, 3) for name, value in habits.states.items()}
    dials = tuple(round(value, 3) for value in habits.dials)
    names = ("mean", "spread", "warning", "reluctance", "known")
    numbers = {name: round(getattr(habits, name), 3) for name in names}
    return replace(habits, **numbers, states=states, dials=dials)


def main(words: Sequence[str]) -> int:
    """Simulate, fit, write."""
    given = dict(word.split(":=", 1) for word in words)
    files = Files()
    out = Path(given.get("out", files.share("fabric_sim") / "config/take_overs.yaml"))
    models = Models.shipped(files)
    with tempfile.TemporaryDirectory() as folder:
        recorded = simulate(Path(folder), int(given.get("people", PEOPLE)), files)
    everybody = {name: own for name, own in watch_all(models, recorded.people).items() if own}
    people = [History.of(take_overs) for take_overs in everybody.values()]
    dials = np.array([dials_of(int(name.removeprefix(PERSON))) for name in everybody])
    fit = Fit(models.pomdp.states, models.selector.models.types)
    areas = left_out(fit, people, dials)
    print("AUC, people left out:", {name: round(area, 3) for name, area in areas.items()})
    digest = hashlib.sha256(models.path.read_bytes()).hexdigest()
    habits = _rounded(fit.habits(fit.run(people), by_dials(people, dials)))
    habits = replace(habits, model=digest, people=len(people))
    habits.save(out, HEAD)
    print(f"{sum(len(p.accepted) for p in people)} take-overs of {len(people)} people: wrote {out}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
