# SPDX-License-Identifier: BSD-3-Clause
"""Somebody drives the person of sim.launch through the page, from the first button to the row."""

from __future__ import annotations

import csv
import json
import re
import urllib.request
from pathlib import Path
from typing import Any

import test_runs

WORDS = ("human:=manual", "speed:=4", "tasks:=1", "seed:=101", "record:=false", "policy:=none")


class Page:
    """What a browser does with the page at `url`."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._news = urllib.request.urlopen(url + "events", timeout=test_runs.DEADLINE)

    def press(self, name: str) -> dict[str, Any]:
        origin = "/".join(self._url.split("/")[:3])
        headers = {"Content-Type": "application/json", "Origin": origin}
        body = json.dumps({"name": name}).encode()
        request = urllib.request.Request(self._url + "command", body, headers)
        with urllib.request.urlopen(request, timeout=test_runs.DEADLINE) as answer:
            return json.load(answer)

    def until(self, condition) -> dict[str, Any]:
        """The first news that fulfil the condition."""
        for line in self._news:
            if line.startswith(b"data: "):
                news = json.loads(line[len(b"data: ") :])
                if condition(news):
                    return news
        raise AssertionError("the page fell silent")


def page_of(process) -> Page:
    for line in process.stdout:
        found = re.search(r"http://localhost:\d+/[\w-]+/", line)
        if found:
            return Page(found[0])
    raise AssertionError("no page was announced")


def test_the_person_does_the_task_by_the_buttons(tmp_path: Path) -> None:
    with test_runs.running(tmp_path, *WORDS) as process:
        page = page_of(process)
        page.until(lambda news: news["waiting"])
        assert "press begin first" in page.press("grasp")["reason"]
        assert page.press("begin")["accepted"]
        assert page.press("look_around")["accepted"]
        page.until(lambda news: news["person"]["action"] == "look_around")
        assert page.press("walk_away")["accepted"]
        page.until(lambda news: news["person"]["away"])
        assert page.press("come_back")["accepted"]
        page.until(lambda news: news["cubes"]["pick_point"] and not news["person"]["away"])
        assert page.press("warn")["accepted"]
        page.until(lambda news: "warn" in news["person"]["state"])
        assert page.press("grasp")["accepted"]
        told, _ = process.communicate(timeout=test_runs.DEADLINE)
    assert test_runs.status(tmp_path) == "finished", told
    with (tmp_path / "results.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["human"], row["human_succeeded"], row["warnings"]) == ("manual", "1", "1")


def test_time_without_speed_is_refused(tmp_path: Path) -> None:
    with test_runs.running(tmp_path, "human:=manual") as process:
        told, _ = process.communicate(timeout=test_runs.DEADLINE)
    assert "/cell/speed is 0, want more than 0 with human manual" in told
