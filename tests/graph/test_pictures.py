# SPDX-License-Identifier: BSD-3-Clause
"""A run on rendered pictures to its end: without ROS the same, replayed the same, and timed."""

from __future__ import annotations

from pathlib import Path

import pytest
from whole_runs import event_log, headless, outcome, run

WORDS = ("sensing:=camera", "seed:=111", "tasks:=1", "human:=expert_rested_attentive_collaborative")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> tuple[Path, str]:
    """The folder of an inspection whose bag holds the pictures, and what the run said."""
    folder = tmp_path_factory.mktemp("pictures") / "run"
    return folder, run(folder, *WORDS, "policy:=none", "pictures:=true")


def test_the_graph_and_the_headless_runner_see_and_decide_the_same(recorded, tmp_path):
    folder, told = recorded
    results = (folder / "results.csv").read_text()
    assert (results, event_log(told)) == headless(tmp_path, *WORDS, "policy:=none")


def test_replayed_pictures_are_perceived_as_they_were(recorded, tmp_path):
    bag = f"file:={recorded[0] / 'task_001.bag'}"
    summary = outcome(tmp_path, "perceive", bag)
    assert summary["pictures"] > 300
    assert summary["agreement"]["gesture"] > 0.99
    assert summary["agreement"]["looking_around"] > 0.99
    replayed, was = summary["replayed"], summary["recorded"]
    assert replayed["container_changes"] == was["container_changes"]
    assert replayed["messages"]["observation"] == was["messages"]["observation"]


def test_answers_to_the_pictures_are_timed(recorded, tmp_path):
    bag = f"file:={recorded[0] / 'task_001.bag'}"
    found = outcome(tmp_path, "latency", bag, "rate:=5", "pictures:=15")
    assert found["human/head"]["told"] == 15
    for topic in ("human/activity", "human/head"):
        assert 0.0 < found[topic]["p50"] <= found[topic]["p95"] <= found[topic]["most"]
    assert set(found["core_percent"]) == {"tracking", "gesture", "head"}
