# SPDX-License-Identifier: BSD-3-Clause
"""Cards and names: they tell what a policy did, and no two policies have one name."""

import numpy as np
import pytest

from fabric_abps.cards import Candidate, card, names_of, sentence
from fabric_abps.dials import DIALS, Setting

PEOPLE = np.array([[0.1, 0.2, 0.9, 0.8], [0.9, 0.3, 0.1, 0.7], [0.7, 0.9, 0.6, 0.6]])


def candidate(name: str, take_overs: float, pointings: float, **factors: float) -> Candidate:
    setting = Setting({dial.name: factors.get(dial.name, 1.0) for dial in DIALS}, "mixed", 0.1)
    if name in ("proactive", "reactive"):
        setting = None
    notices = np.tile([0.9, 0.1, take_overs, pointings, 31.0], (3, 1))
    return Candidate(name, setting, "", "", "", np.array([1.0, 4.0, 6.0]), notices, PEOPLE)


def test_names_say_how_much_a_policy_takes_over_and_how_it_is() -> None:
    some = [
        candidate("proactive", 0.4, 0.5),
        candidate("candidate_001", 0.1, 0.9, refusal=4.0, failing=2.0),
        candidate("candidate_002", 0.9, 0.1, refusal=0.2),
        candidate("candidate_003", 0.5, 0.1),
    ]
    assert names_of(some, ("proactive",)) == [
        "proactive", "reserved_wary", "active_bold", "balanced_usual",
    ]  # fmt: skip


def test_namesakes_take_a_further_dial_or_a_number() -> None:
    turned = ({"refusal": 8.0, "failing": 3.0}, {"refusal": 8.0, "failing": 3.0}, {"refusal": 6.0})
    some = [candidate(f"candidate_{i:03d}", 0.1, 0.1, **turned[i]) for i in range(3)]
    some += [candidate(f"candidate_{i:03d}", 0.9, 0.1, failing=3.0) for i in range(3, 9)]
    names = names_of(some, ())
    assert names[:3] == ["reserved_wary", "reserved_strict", "reserved_wary_2"]
    assert len(set(names)) == 9


def test_a_sentence_tells_the_dials_that_are_turned_furthest_and_what_was_done() -> None:
    text = sentence(candidate("candidate_001", 0.4, 1.26, refusal=5.0, pointing=0.5, trust=1.1))
    assert text == (
        "Is wary of warnings, sees little use in reminding; 0.4 take-overs, 1.3 pointings a task."
    )
    assert "by fixed rules" in sentence(candidate("reactive", 0.4, 0.0))


def test_a_card_holds_each_dial_the_means_and_the_reward_by_kind_of_person() -> None:
    text = card("inspection", "reserved_silent", candidate("candidate_001", 0.4, 0.0, failing=2.0))
    assert text.startswith("<!-- SPDX")
    for line in (
        "# reserved_silent",
        "| failing | 2 | sees attempts fail early |",
        "| tiring | 1 | is as the base model |",
        "| reward, points | 3.67 |",
        "| take-overs | 0.40 |",
        "| duration, s | 31.00 |",
        "| beginners | 1.00 | experts | 5.00 |",
        "| tired | 2.50 | rested | 6.00 |",
        "| noncollaborative | - | collaborative | 3.67 |",
    ):
        assert line in text.splitlines()


@pytest.mark.parametrize("observability", ["hidden", "mixed observability", "MDP"])
def test_a_card_says_what_is_seen(observability) -> None:
    base = candidate("candidate_001", 0.0, 0.0)
    texts = []
    for name in ("pomdp", "mixed", "mdp"):
        setting = Setting(base.setting.factors, name)
        texts.append(card("sorting", "x", Candidate(**{**vars(base), "setting": setting})))
    assert any(observability in text for text in texts)
    assert len(set(texts)) == 3
