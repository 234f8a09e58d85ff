# SPDX-License-Identifier: BSD-3-Clause
"""The page of somebody at the keys: shows and commands, for this machine and token only."""

import asyncio
import json
from html.parser import HTMLParser

import pytest
from aiohttp.test_utils import TestClient, TestServer

from fabric_msgs.msg import (
    Cube,
    CubeArray,
    Decision,
    GroundTruth,
    RobotActionState,
    SortingRule,
    TaskState,
)
from fabric_sim.manual_commands import COMMANDS
from fabric_sim.manual_page import default_folder, make_app
from fabric_sim.manual_view import ManualView

TOKEN = "t0ken"
GRASP = {"name": "grasp", "container": ""}


class Desk:
    """Takes notes instead of driving a person."""

    def __init__(self):
        self.commands = []
        self.view = ManualView()

    def snapshot(self):
        return self.view.snapshot()

    async def command(self, name, container):
        self.commands.append((name, container))
        return name != "sing", "nobody can sing" if name == "sing" else ""


def visit(doing):
    """Run `doing(client, desk, own)`; own: headers of a request that the page itself sends."""

    async def run():
        desk = Desk()
        async with TestClient(TestServer(make_app(desk, TOKEN))) as client:
            own = {"Origin": f"http://127.0.0.1:{client.port}"}
            return await doing(client, desk, own)

    return asyncio.run(run())


def status_of(method, path, own=True, **kwargs):
    """Status of one request and the commands that came through."""

    async def doing(client, desk, headers):
        given = kwargs.pop("headers", {})
        headers = (headers if own else {}) | given
        answer = await client.request(method, path, headers=headers, **kwargs)
        return answer.status, desk.commands

    return visit(doing)


def test_a_command_reaches_the_person_and_its_refusal_the_page():
    async def doing(client, desk, own):
        answers = []
        for name in ("place", "sing"):
            command = {"name": name, "container": "red"}
            answer = await client.post(f"/{TOKEN}/command", json=command, headers=own)
            answers.append(await answer.json())
        return answers, desk.commands

    answers, commands = visit(doing)
    assert answers[0] == {"accepted": True, "reason": ""}
    assert answers[1] == {"accepted": False, "reason": "nobody can sing"}
    assert commands == [("place", "red"), ("sing", "red")]


@pytest.mark.parametrize("path", ["/", "/command", "/wrong/command", "/t0ke/command"])
def test_without_the_token_nothing_is_there(path):
    assert status_of("GET", path)[0] == 404
    assert status_of("POST", path, json=GRASP) == (404, [])


@pytest.mark.parametrize(
    "path",
    ["/../manual_page.py", "/..%2fmanual_page.py", "/manual.html", "/%2e%2e/%2e%2e/etc/passwd"],
)
def test_only_the_files_of_the_page_are_served(path):
    assert status_of("GET", f"/{TOKEN}{path}")[0] == 404


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1"])
def test_another_site_cannot_send_commands(origin):
    headers = {"Origin": origin}
    assert status_of("POST", f"/{TOKEN}/command", json=GRASP, headers=headers) == (403, [])


def test_a_command_without_origin_is_refused():
    assert status_of("POST", f"/{TOKEN}/command", own=False, json=GRASP) == (403, [])


def test_a_name_bound_to_this_machine_by_somebody_else_is_refused():
    for method, path in (("GET", f"/{TOKEN}/"), ("POST", f"/{TOKEN}/command")):
        for host in ("evil.example", "localhost.evil.example", "127.0.0.1.nip.example:80"):
            headers = {"Host": host, "Origin": f"http://{host}"}
            assert status_of(method, path, json=GRASP, headers=headers) == (403, [])


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (json.dumps(GRASP), "text/plain", 415),
        ("name=grasp", "application/x-www-form-urlencoded", 415),
        ("{", "application/json", 400),
        ('["grasp"]', "application/json", 400),
        ('{"container": "red"}', "application/json", 400),
        ('{"name": 3}', "application/json", 400),
        ('{"name": "grasp", "speed": "9"}', "application/json", 400),
        ('{"name": "' + "g" * 5000 + '"}', "application/json", 413),
    ],
)
def test_a_malformed_command_is_refused(body, kind, status):
    sent = status_of("POST", f"/{TOKEN}/command", data=body, headers={"Content-Type": kind})
    assert sent == (status, [])


class Elements(HTMLParser):
    """Checks that elements are closed in order; collects buttons and what is loaded."""

    VOID = ("meta", "link", "input", "br")

    def __init__(self):
        super().__init__()
        self.open, self.buttons, self.loaded, self.ids = [], {}, [], []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.loaded += [values[k] for k in ("src", "href") if k in values]
        if tag == "button":
            self.buttons[values["data-name"]] = values["data-key"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_has_a_button_for_every_command_with_its_key():
    async def doing(client, desk, own):
        page = await client.get(f"/{TOKEN}/")
        found = Elements()
        found.feed(await page.text())
        for name in found.loaded:
            if not name.startswith("data:"):
                assert (await client.get(f"/{TOKEN}/{name}")).status == 200
        return page, found

    page, found = visit(doing)
    assert not found.open
    assert len(set(found.ids)) == len(found.ids)
    by_tray = {"place"}
    expected = {c.name: c.key for c in COMMANDS if c.name not in by_tray}
    assert found.buttons == expected
    assert "default-src 'self'" in page.headers["Content-Security-Policy"]
    assert page.headers["Referrer-Policy"] == "no-referrer"


def test_every_element_that_the_script_fills_is_on_the_page():
    folder = default_folder()
    found = Elements()
    found.feed((folder / "manual.html").read_text())
    script = (folder / "manual.js").read_text()
    used = {
        part.split('"')[1] for start in ("say(", "put(", "at(") for part in _calls(script, start)
    }
    assert used
    assert used <= set(found.ids)


def _calls(script, start):
    return [part for part in script.split(start)[1:] if part.startswith('"')]


async def news(stream):
    """The next event of a stream."""
    async for line in stream.content:
        if line.startswith(b"data: "):
            return json.loads(line.removeprefix(b"data: "))
    raise AssertionError("the stream ended")


def test_news_are_streamed_when_something_changes():
    async def doing(client, desk, own):
        stream = await client.get(f"/{TOKEN}/events")
        first = await news(stream)
        desk.view.take(TaskState(task_id=4, status=TaskState.RUNNING), "task/state")
        return first, await news(stream)

    first, second = visit(doing)
    assert (first["task"]["number"], second["task"]["number"]) == (0, 4)


def sorting(view, truth_of=1):
    rules = [SortingRule(colour=1, label="red"), SortingRule(colour=3, label="blue")]
    task = TaskState(task_id=1, status=TaskState.RUNNING, scenario="sorting", rules=rules)
    task.started = 2.0
    cubes = [Cube(id=2, colour=1, where=Cube.WHERE_BELT)]
    cubes += [Cube(id=1, colour=3, where=Cube.WHERE_PICK_POINT)]
    truth = GroundTruth(task_id=truth_of, action="idle", state="evaluating")
    truth.header.stamp.secs = 5
    robot = RobotActionState(current=Decision.GRASP, phase=RobotActionState.PHASE_CARRY)
    view.take(task, "task/state")
    view.take(CubeArray(cubes=cubes), "cell/cubes")
    view.take(truth, "truth")
    view.take(robot, "robot/state")
    return view.snapshot()


def test_the_view_tells_the_newest_messages_in_plain_words():
    news = sorting(ManualView())
    assert news["task"]["seconds"] == 3.0
    assert news["task"]["rules"][1] == {
        "colour": "blue", "occurrence": 0, "tray": "blue",
        "word": None, "ink": None, "ink_counts": False,
    }  # fmt: skip
    assert news["trays"] == ["blue", "red"]
    assert news["robot"] == "takes over, carrying"
    assert news["cubes"] == {"belt": ["red"], "pick_point": ["blue"], "person": [], "robot": []}
    assert not news["waiting"]


def test_a_task_whose_time_has_not_begun_waits_without_cubes_of_the_last_one():
    news = sorting(ManualView(), truth_of=0)
    assert news["waiting"]
    assert not any(news["cubes"].values())


def test_the_time_of_a_task_starts_with_it_and_ends_with_it():
    view = ManualView()
    sorting(view)
    for status, seconds in ((TaskState.SHOWING_RULES, 0.0), (TaskState.SUCCEEDED, 9.5)):
        view.take(TaskState(task_id=1, status=status, duration=9.5), "task/state")
        assert view.snapshot()["task"]["seconds"] == seconds


def test_digits_are_the_trays_of_the_running_task():
    view = ManualView()
    sorting(view)
    assert view.command_of_key("1") == ("place", "blue")
    assert view.command_of_key("3") is None
