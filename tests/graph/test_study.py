# SPDX-License-Identifier: BSD-3-Clause
"""A visit through the pages of study.launch, as browsers go through it, with the simulated cell."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import whole_runs
import yaml
from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.websocket import websocket_connect

from fabric_study.store import read_records
from fabric_study.store_verify import verify

WORDS = ("speed:=8", "seed:=101", "port:=0", "record:=false")
STUDY = {"launch": "study", "named": "study"}
AGREEMENT = {n: {"en": f"step {n}", "de": f"Stufe {n}"} for n in range(1, 6)}
TASK = {
    "scenario": "sorting",
    "cubes": {"count": 2, "order": ["red", "blue"]},
    "rules": {"red": "red", "green": "green", "blue": "blue"},
    "rules_display_time": 2.0,
    "t_max": 30.0,
    "belt_speed": 0.05,
    "success_needs": 1,
    "scores": {"person": 10, "robot": 4, "wrong": -6},
}


def words(text: str) -> dict[str, str]:
    return {"en": text, "de": text}


def write_protocol(folder: Path) -> Path:
    """A visit of a text, a task of two cubes and a question."""
    folder.mkdir()
    task = folder / "two_cubes.yaml"
    task.write_text(yaml.safe_dump(TASK))
    asked = {
        "title": words("After"),
        "when": "task",
        "shuffle": False,
        "labels": AGREEMENT,
        "items": {"trust": {"kind": "likert", "category": "robot", "text": words("I trust it.")}},
    }
    (folder / "after.yaml").write_text(yaml.safe_dump(asked, sort_keys=False))
    condition = {
        "shown_as": words("robot"), "definition": str(task), "policy": "proactive", "tasks": 1,
    }  # fmt: skip
    plan = {
        "title": words("Short"),
        "people": 2,
        "order": {"kind": "balanced"},
        "start": [{"text": words("Welcome")}],
        "conditions": {"only": condition},
        "after_task": ["after"],
        "after_condition": [],
        "end": [],
    }
    path = folder / "short.yaml"
    path.write_text(yaml.safe_dump(plan, sort_keys=False))
    return path


class Page:
    """What a browser does with one of the pages."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._origin = "/".join(url.split("/")[:3])
        self._cookies: dict[str, str] = {}
        self._known: dict[str, Any] = {}

    async def open(self, name: str) -> None:
        """Follow the printed address, then connect the live socket."""
        url = self._url
        for _ in range(2):  # the page, after the cookie
            request = HTTPRequest(url, headers=self._headers(), follow_redirects=False)
            answer = await AsyncHTTPClient().fetch(request, raise_error=False)
            for cookie in answer.headers.get_list("Set-Cookie"):
                key, _, value = cookie.split(";")[0].partition("=")
                self._cookies[key] = value
            url = self._origin + answer.headers.get("Location", "")
        live = self._origin.replace("http", "ws", 1) + f"/live/{name}"
        headers = self._headers() | {"Origin": self._origin}
        self._socket = await websocket_connect(HTTPRequest(live, headers=headers))

    def _headers(self) -> dict[str, str]:
        return {"Cookie": "; ".join(f"{k}={v}" for k, v in self._cookies.items())}

    async def until(self, condition: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """What the page knows once the condition holds."""

        async def wait() -> dict[str, Any]:
            while not (self._known and condition(self._known)):
                text = await self._socket.read_message()
                assert text is not None, f"the page is cut off; it knew {self._known}"
                self._known.update(json.loads(text))
            return self._known

        try:
            return await asyncio.wait_for(wait(), whole_runs.DEADLINE)
        except TimeoutError:
            raise AssertionError(f"never came; the page knows {self._known}") from None

    def knows(self, section: str) -> Any:
        """What the page was told last of a section."""
        return self._known[section]

    async def ask(self, name: str, **fields: Any) -> Any:
        headers = self._headers() | {"Content-Type": "application/json"}
        headers["X-XSRFToken"] = self._cookies["_xsrf"]
        request = HTTPRequest(
            f"{self._origin}/api/{name}", method="POST", body=json.dumps(fields), headers=headers
        )
        answer = await AsyncHTTPClient().fetch(request, raise_error=False)
        told = json.loads(answer.body)
        assert answer.code == 200, (name, told)
        return told["answer"]


def addresses(process) -> tuple[str, str]:
    """Those of the console and of the participant's page, as they are printed."""
    found: list[str] = []
    told = []
    for line in process.stdout:
        told.append(line)
        found += re.findall(r"http://127\.0\.0\.1:\d+/\S*\?token=\S+", line)
        if len(found) == 2:
            return found[0], found[1]
    raise AssertionError("".join(told))


async def connect(console: Page, page: Page) -> None:
    """Open both pages and wait for the graph."""
    await console.open("console")
    await page.open("participant")
    await console.until(lambda known: not known["health"]["missing"])


async def begin(console: Page, page: Page) -> None:
    """Start a visit and read its first text."""
    await console.ask("open_visit", index=0, language="en")
    await page.until(lambda known: known["step"] and known["step"]["kind"] == "text")
    await page.ask("finish_step", step="start_1", accept_missing=False)


async def do_task(console: Page, page: Page) -> None:
    """Go through the task, from its rules to its result."""
    await page.ask("ready", step="task_1")
    shown = await page.until(lambda known: known["task"] and known["task"]["phase"] == "rules")
    assert [item["colour"] for item in shown["task"]["items"]] == ["red", "green", "blue"]
    shown = await page.until(lambda known: known["task"]["phase"] == "running")
    assert "items" not in shown["task"]
    await console.until(lambda known: known["belief"] and known["decisions"])
    shown = await page.until(lambda known: known["task"]["phase"] == "ended"
                             and known["task"]["result"]["saved"])  # fmt: skip
    assert len(shown["task"]["placements"]) == 2
    await page.ask("finish_step", step="task_1", accept_missing=False)


async def answer(console: Page, page: Page) -> None:
    """Answer the question; the visit ends with it."""
    person = page.knows("visit")["person"]
    await page.ask("answer", person=person, step="task_1_after", item="trust", value=4)
    shown = await page.until(lambda known: known["questions"] and known["questions"]["answers"])
    assert shown["questions"]["answers"] == {"trust": 4}
    await console.ask("note", text="all went well")
    await page.ask("finish_step", step="task_1_after", accept_missing=False)
    await page.until(lambda known: known["visit"]["status"] == "finished")


async def stop_and_release(console: Page, _: Page) -> None:
    """The big button, and what undoes it."""
    await console.ask("stop")
    shown = await console.until(lambda known: (known["safety"] or {}).get("state") == "stop")
    assert "console" in shown["safety"]["cause"]
    await console.ask("release")
    await console.until(lambda known: known["safety"]["state"] == "run")


async def whole_visit(console: Page, page: Page) -> None:
    for part in (connect, stop_and_release, begin, do_task, answer):
        await part(console, page)


async def into_the_task(console: Page, page: Page) -> None:
    """As far as the first event of the task."""
    await connect(console, page)
    await begin(console, page)
    await page.ask("ready", step="task_1")
    await console.until(lambda known: known["task"] and known["task"]["events"])


async def rest_of_visit(console: Page, page: Page) -> None:
    """What is left after the task was cut off, on pages that find themselves where they were."""
    await connect(console, page)
    shown = await page.until(lambda known: known["visit"])
    assert (shown["step"]["id"], shown["task"]["phase"]) == ("task_1", "ready")
    assert shown["visit"]["language"] == "en"
    await do_task(console, page)
    await answer(console, page)


def kill_console(process) -> None:
    """As a power cut would, from one moment to the next."""
    port = process.args[process.args.index("-p") + 1]
    master = ServerProxy(f"http://localhost:{port}")
    _, _, uri = master.lookupNode("/test_study", "/console")
    _, _, pid = ServerProxy(uri).getPid("/test_study")
    os.kill(pid, signal.SIGKILL)


def test_a_visit_through_the_pages_is_in_the_store(tmp_path: Path) -> None:
    study, protocol = tmp_path / "study", write_protocol(tmp_path / "plan")
    with whole_runs.running(study, *WORDS, f"protocol:={protocol}", **STUDY) as process:
        asyncio.run(whole_visit(*map(Page, addresses(process))))
        process.send_signal(signal.SIGINT)
        told, _ = process.communicate(timeout=whole_runs.DEADLINE)
    records = read_records(study)
    kinds = [record.kind for record in records]
    for kind in ("visit_opened", "task_begun", "task_done", "visit_closed"):
        assert kinds.count(kind) == 1, kinds
    (row,) = [record.content["row"] for record in records if record.kind == "task_done"]
    assert (row["scenario"], row["policy"], row["task"]) == ("sorting", "proactive", 1)
    (given,) = [record.content for record in records if record.kind == "answer"]
    assert (given["item"], given["value"], given["condition"]) == ("trust", 4, "only")
    assert whole_runs.status(study / "runs" / "1") == "finished"
    assert "SIGKILL" not in told and "escalating" not in told
    assert verify(study).faults == []


def test_a_visit_goes_on_after_the_console_was_killed_in_a_task(tmp_path: Path) -> None:
    study, protocol = tmp_path / "study", write_protocol(tmp_path / "plan")
    with whole_runs.running(study, *WORDS, f"protocol:={protocol}", **STUDY) as process:
        first = addresses(process)
        asyncio.run(into_the_task(*map(Page, first)))
        kill_console(process)
        process.communicate(timeout=whole_runs.DEADLINE)  # the whole launch ends with it
    with whole_runs.running(study, *WORDS, **STUDY) as process:
        again = addresses(process)
        assert [url.split("=")[1] for url in again] == [url.split("=")[1] for url in first]
        asyncio.run(rest_of_visit(*map(Page, again)))
    records = read_records(study)
    kinds = [record.kind for record in records]
    assert (study / "people" / f"{records[-1].visit}_sorting.json").exists()  # what ABPS knows
    assert (kinds.count("task_begun"), kinds.count("task_aborted"), kinds.count("task_done")) == (
        2,
        1,
        1,
    )
    assert sorted(path.name for path in (study / "runs").iterdir()) == ["1", "2"]
    assert verify(study).faults == []
