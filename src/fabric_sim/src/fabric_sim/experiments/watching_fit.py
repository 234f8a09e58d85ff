# SPDX-License-Identifier: BSD-3-Clause
"""How the people of a folder were watched: the few numbers of `Watching`, estimated from trials.

Cameras, trays and belts differ between cells, and recordings do not say how. The numbers are common
to all people, and nobody's own trials decide on the ones used for him or her: the people are dealt
into two groups, and each group is explained by what was learnt from the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from fabric_sim.character import Character
from fabric_sim.experiments.explain import Explainer
from fabric_sim.experiments.jobs import run_jobs
from fabric_sim.experiments.trials import Trial, by_person
from fabric_sim.experiments.watching import Watching

#: Values that are tried, from least to most.
LADDERS: dict[str, tuple[float, ...]] = {
    "held": (0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.9),
    "hidden": (0.0, 0.3, 0.6, 0.8, 0.9),
    "report": (1.0, 2.0, 4.0, 6.0, 8.0),
    "slip": (0.02, 0.05, 0.1, 0.15),
    "wait": (2.0, 4.0, 6.0, 10.0, 15.0),
    "confusion": (0.05, 0.1, 0.2),
    "stray_event": (0.002, 0.01, 0.03),
    "carried": (1.0, 0.5, 0.0),
    "remembered": (1.0, 0.5, 0.0),
}
_ROUNDS = 3
_MOST = 10  # trials a group that are looked at
#: People that the numbers are judged by: who explains the trials best counts.
_REFERENCES = (
    Character(0.9, 0.95, 0.8, 0.7),
    Character(0.7, 0.8, 0.5, 0.5),
    Character(0.5, 0.5, 0.5, 0.5),
    Character(0.2, 0.8, 0.6, 0.5),
)


class WatchingFit:
    """A coordinate search over LADDERS, up from the simulated cell's own numbers."""

    def __init__(self, trials: Sequence[Trial], start: Watching) -> None:
        step = max(1, -(-len(trials) // _MOST))
        self._people = [(own, range(len(own))[index::step]) for index, own in _numbered(trials)]
        self._start = start
        self._known: dict[tuple[int, ...], float] = {}

    def best(self) -> Watching:
        """Return the numbers that explain the trials best."""
        at = dict.fromkeys(LADDERS, 0)
        at["held"] = len(LADDERS["held"]) // 2
        for _ in range(_ROUNDS):
            before = dict(at)
            for name in LADDERS:
                at[name] = self._climb(at, name)
            if at == before:
                break
        return self._watching(at)

    def _climb(self, at: dict[str, int], name: str) -> int:
        """Go up or down one ladder while it gets better."""
        best, score = at[name], self._score(at)
        for step in (1, -1):
            while 0 <= best + step < len(LADDERS[name]):
                tried = self._score({**at, name: best + step})
                if tried <= score:
                    break
                best, score = best + step, tried
        return best

    def _score(self, at: dict[str, int]) -> float:
        key = tuple(at.values())
        if key not in self._known:
            explainer = Explainer(self._watching(at))
            self._known[key] = sum(_explained(explainer, *person) for person in self._people)
        return self._known[key]

    def _watching(self, at: dict[str, int]) -> Watching:
        values = {name: LADDERS[name][index] for name, index in at.items()}
        sensing = replace(self._start.sensing, confusion=values.pop("confusion"))
        return replace(self._start, sensing=sensing, **values)


def _numbered(trials: Sequence[Trial]) -> list[tuple[int, list[Trial]]]:
    return list(enumerate(by_person(trials).values()))


def _explained(explainer: Explainer, own: list[Trial], chosen: range) -> float:
    """Log-likelihood of some of a person's trials by the reference that explains them best."""
    pasts = explainer.pasts(own)
    trials = [own[k] for k in chosen]
    scores = explainer.after([pasts[k] for k in chosen], _REFERENCES, trials)
    return float(scores.sum(axis=0).max())


def watching_of_people(
    trials: Sequence[Trial], start: Watching, jobs: int = 1
) -> dict[str, Watching]:
    """Return how each person is taken to have been watched, learnt from the other group.

    With one person only there is no other group, and the person's own trials have to do.
    """
    people = by_person(trials)
    names = list(people)
    groups = [names[0::2], names[1::2]]
    sources = [
        [trial for name in other or own for trial in people[name]]
        for own, other in (groups, groups[::-1])
        if own
    ]
    learnt = run_jobs(partial(_learn, start), sources, jobs, "how they were watched")
    return {name: found for own, found in zip(groups, learnt) for name in own}  # noqa: B905


def _learn(start: Watching, source: list[Trial]) -> Watching:
    return WatchingFit(source, start).best()
