# SPDX-License-Identifier: BSD-3-Clause
"""The selector explains itself: ranking, the observations that moved the belief, flags."""

import numpy as np
import pytest
from conftest import POLICIES, TYPES, run_job
from test_selector import live, live_with, observation

from fabric_abps import Selector, SelectorParameters, train
from fabric_abps.evidence import TaskEvidence
from fabric_abps.explain import Move, moves


@pytest.fixture
def selector(library) -> Selector:
    models = train(library, TYPES, run_job, tasks=40, seed=11)
    return Selector(library, models, SelectorParameters(change_rate=0.02))


def test_before_anything_happened_there_is_nothing_to_tell(selector) -> None:
    explained = selector.explain()
    assert explained.ranking == explained.moves == ()
    assert str(explained) == ""
    assert explained.typicality == 1.0


def test_the_ranking_holds_every_candidate_best_first(selector) -> None:
    live_with(selector, "hasty", 4)
    choice = selector.select(5, 0)
    ranking = selector.explain().ranking
    assert {name for name, _, _ in ranking} == set(POLICIES)
    assert ranking[0][0] == choice.policy
    scores = [score for _, score, _ in ranking]
    assert scores == sorted(scores, reverse=True)


def test_the_moves_sum_to_the_log_ratio_that_moved_the_belief(selector) -> None:
    evidence = TaskEvidence(0)
    for code in (33, 33, 17, 1, 17, 17):
        evidence.observe(observation(1, code))
    model = selector.models.observation
    before = np.array([0.5, 0.3, 0.2])
    weight = evidence.weight(3.0) * evidence.log_likelihood(model)
    after = before * np.exp(weight)
    after /= after.sum()
    told = moves(evidence, model, 3.0, list(TYPES), before, after)
    tau = int(np.argmax(after))
    assert sum(move.log_ratio for move in told) == pytest.approx(weight[tau] - before @ weight)
    assert sum(move.count for move in told) == 6
    assert [abs(m.log_ratio) for m in told] == sorted(
        [abs(m.log_ratio) for m in told], reverse=True
    )


def test_warnings_are_what_tells_a_touchy_person(selector) -> None:
    selector.select(1, 0)
    live(selector, 1, [33, 5, 17, 17, 1, 17, 17, 33])
    told = selector.explain().moves[0]
    assert (told.words, told.count, told.tau) == ("detected, warning", 4, "touchy")
    assert told.log_ratio > 0
    selector.select(2, 0)
    assert str(selector.explain()).startswith(
        "Most telling in the last task: 'detected, warning' 4 times, "
    )


def test_a_move_is_told_in_plain_words() -> None:
    move = Move("detected, idle", 1, np.log(3.0), "expert_tired")
    assert str(move) == "'detected, idle' once, 3 times as likely for expert tired"
    move = Move("detected, idle", 2, -np.log(4.0), "expert_tired")
    assert str(move) == "'detected, idle' twice, 4 times less likely for expert tired"


def test_it_says_when_somebody_else_seems_to_have_come(selector) -> None:
    live_with(selector, "calm", 15)
    changed = False
    for task_id in range(16, 22):
        live_with(selector, "touchy", 1, first=task_id)
        changed |= "Somebody else seems to have come." in str(selector.explain())
    assert changed
    assert selector.belief.most_likely == "touchy"
    assert selector.tasks_seen <= 7
