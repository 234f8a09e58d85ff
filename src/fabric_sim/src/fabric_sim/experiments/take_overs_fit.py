# SPDX-License-Identifier: BSD-3-Clause
"""Learns how people answer take-overs from simulated people, and writes config/take_overs.yaml.

    python3 -m fabric_sim.experiments.take_overs_fit [people:=200] [out:=FILE]

Each person is a random point of the character cube and sorts three times beside the proactive and
three times beside the reactive robot, recorded as a real person would be. Maximum of the likelihood
of their answers, each given the answers before it, with a normal prior of standard deviation 1 on
the states' log-odds and 2 on the dials'. Also prints how well people who were left out are
predicted.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from tqdm import tqdm

from fabric_planner import AlphaVectors
from fabric_sim.batch_decider import AgentDecider
from fabric_sim.batch_loop import Files, RunSetup
from fabric_sim.character import named_generator
from fabric_sim.experiments.recorder import RecordedRun
from fabric_sim.experiments.take_overs_belief import Habits, History, TypeStateModel
from fabric_sim.experiments.take_overs_read import SCENARIO, Folder, read_folder
from fabric_sim.experiments.take_overs_score import auc
from fabric_sim.experiments.take_overs_watch import Models, watch_all
from fabric_sim.experiments.trials import write_rows
from fabric_sim.staff import Staff

PEOPLE = 200
SHIFTS = (("proactive", 3), ("reactive", 3))  # robot, tasks
FIRST_SEED, SEEDS = 101, 99  # development seeds; those of reports are never used
STEPS = 40  # of the optimiser; the likelihood moves by less than .1 after about 25
STATE_PRIOR, DIAL_PRIOR = 1.0, 2.0  # standard deviations
HEAD = """\
# SPDX-License-Identifier: BSD-3-Clause
# How people answer take-overs, learnt from simulated people alone; written by
# python3 -m fabric_sim.experiments.take_overs_fit. Log-odds of accepting; docs/replay.md explains.
"""


def simulate(folder: Path, people: int, files: Files) -> Folder:
    """Record `people` random people into a folder and read it back."""
    solved = {robot: files.solve(robot, SCENARIO) for robot, _ in SHIFTS}
    for number in tqdm(range(people), desc="people", leave=False):
        _record(folder, number, files, solved)
    return read_folder(folder)


def _record(folder: Path, number: int, files: Files, solved: dict[str, AlphaVectors]) -> None:
    seed = FIRST_SEED + number % SEEDS
    rng = named_generator(seed, "people who are taken over", number // SEEDS)
    dials = ",".join(f"{value:.3f}" for value in rng.random(4))
    staff, task = Staff(dials, seed), 0
    for robot, tasks in SHIFTS:
        agent = files.offline_agent(files.model(robot, SCENARIO), solved[robot])
        run = RecordedRun(
            RunSetup(SCENARIO, dials, robot, seed), staff=staff, decider=AgentDecider(agent)
        )
        for _ in range(tasks):
            task += 1
            write_rows(folder / f"person{number:03d}_task{task}_{robot}.csv", run.record_task())


class Fit:
    """Maximum a posteriori of the numbers of Habits."""

    def __init__(self, states: Sequence[str], types: Sequence[str]) -> None:
        self._states, self._types = list(states), list(types)

    def habits(self, v: np.ndarray) -> Habits:
        """The numbers of a parameter vector (8 + n_states,)."""
        values = [round(float(value), 3) for value in v]
        spread = max(0.001, round(float(np.exp(v[1])), 3))
        states = dict(zip(self._states, values[8:], strict=True))
        return Habits(values[0], spread, tuple(values[2:6]), values[6], values[7], states)

    def cost(self, v: np.ndarray, people: Sequence[History]) -> float:
        """Minus the log posterior, nats, up to a constant."""
        states = dict(zip(self._states, v[8:].tolist(), strict=True))
        habits = Habits(v[0], float(np.exp(v[1])), tuple(v[2:6]), v[6], v[7], states)
        model = TypeStateModel(habits, self._states, self._types)
        prior = (v[8:] ** 2).sum() / STATE_PRIOR**2 + (v[2:6] ** 2).sum() / DIAL_PRIOR**2
        return 0.5 * prior - sum(model.log_likelihood(history) for history in people)

    def run(self, people: Sequence[History]) -> Habits:
        """Return the best numbers for these people."""
        start = np.zeros(8 + len(self._states))
        start[6] = -3.0
        found = minimize(
            self.cost, start, args=(people,), method="L-BFGS-B", options={"maxiter": STEPS}
        )
        return self.habits(found.x)

    def left_out(self, people: Sequence[History]) -> dict[str, float]:
        """AUC of either half of the people, predicted by what the other half taught."""
        halves = [people[::2], people[1::2]]
        truth, chances = [], {"together": [], "state": [], "type": [], "known_types": []}
        for other, half in ((1, 0), (0, 1)):
            model = TypeStateModel(self.run(halves[other]), self._states, self._types)
            for history in halves[half]:
                truth += history.accepted.tolist()
                predictions = model.predict(history)
                for name, values in chances.items():
                    values += getattr(predictions, name).tolist()
        return {name: auc(values, truth) for name, values in chances.items()}


def main(words: Sequence[str]) -> int:
    """Simulate, fit, write."""
    given = dict(word.split(":=", 1) for word in words)
    files = Files()
    out = Path(given.get("out", files.share("fabric_sim") / "config/take_overs.yaml"))
    models = Models.shipped(files)
    with tempfile.TemporaryDirectory() as folder:
        recorded = simulate(Path(folder), int(given.get("people", PEOPLE)), files)
    everybody = watch_all(models, recorded.people)
    people = [History.of(take_overs) for take_overs in everybody.values() if take_overs]
    fit = Fit(models.pomdp.states, models.selector.models.types)
    print("AUC, people left out:", {k: round(v, 3) for k, v in fit.left_out(people).items()})
    habits = fit.run(people)
    digest = hashlib.sha256(models.path.read_bytes()).hexdigest()
    habits = Habits(**{**vars(habits), "model": digest, "people": len(people)})
    habits.save(out, HEAD)
    print(f"{sum(len(p.accepted) for p in people)} take-overs of {len(people)} people: wrote {out}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
