# SPDX-License-Identifier: BSD-3-Clause
"""The pages in Debian's Chromium: whole visits by clicks, keys and taps, and what people see."""

from __future__ import annotations

import asyncio
import copy
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from chromium import Tab, chromium, tab
from fake_cell import GREEN, RED, STROOP, FakeCell, desk_of, fill
from study_play import INSTRUMENTS, PLAN, words, write_plan
from tornado.ioloop import PeriodicCallback

from fabric_study.protocol import load_protocol
from fabric_study.study_folder import open_study
from fabric_study.web.access import Role, new_keys
from fabric_study.web.server import PageServer
from fabric_study.web.visit_desk import VisitDesk

ONE_TASK = {  # a short visit with every kind of step and of question
    **copy.deepcopy(PLAN),
    "start": [{"text": words("Welcome")}, {"instrument": "demographics"}],
    "conditions": {
        "only": {
            "shown_as": words("only"), "definition": "sorting", "policy": "on_call", "tasks": 1,
        },
    },
    "order": {"kind": "balanced"},
}  # fmt: skip
IN_ORDER = {name: {**content, "shuffle": False} for name, content in INSTRUMENTS.items()}
CONTRAST = """(() => {
  const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (e) => {
    for (; e; e = e.parentElement) {
      const colour = parts(getComputedStyle(e).backgroundColor);
      if (colour.length < 4 || colour[3] > 0.99) return colour;
    }
    return [255, 255, 255];
  };
  const poor = [];
  for (const e of document.querySelectorAll("body *")) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.checkVisibility() || e.closest(":disabled")) continue;
    const [a, b] = [light(parts(getComputedStyle(e).color)), light(ground(e))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) poor.push([e.textContent.slice(0, 40), ratio.toFixed(2)]);
  }
  return poor;
})()"""
SAVED = "document.querySelectorAll('.question.saved').length === %d"


@pytest.fixture(scope="module")
def devtools(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("chromium")) as address:
        yield address


@dataclass
class World:
    """A participant and an experimenter before their pages."""

    desk: VisitDesk
    cell: FakeCell
    server: PageServer
    participant: Tab
    console: Tab

    @property
    def step(self) -> str:
        return self.desk.participant()["step"]["id"]

    async def at(self, step: str) -> None:
        """Wait until the participant's page shows this step."""
        await self.participant.until(f"document.getElementById('screen').dataset.step === '{step}'")

    async def begin(self, language: str = "en") -> None:
        """Start a visit with the console's form."""
        await self.console.until("document.getElementById('index').value === '0'")
        await self.console.run(f"document.getElementById('language').value = '{language}'")
        await self.console.click("#start-form button")
        await self.at("start_1")

    async def to_task(self) -> None:
        """Have the visit at its task."""
        for step in ("start_1", "start_demographics"):
            self.desk.finish_step(step, True)
        await self.at("task_1")

    def answers(self) -> dict[str, Any]:
        records = [record.content for record in self.desk._study.store.records
                   if record.kind == "answer"]  # fmt: skip
        return {record["item"]: record["value"] for record in records}

    async def check(self, page: Tab) -> None:
        """What every page must be: readable, within its window, from here only."""
        assert await page.run(CONTRAST) == []
        assert await page.run("document.documentElement.scrollWidth <= innerWidth")


@asynccontextmanager
async def opened(folder: Path, devtools: str) -> AsyncIterator[World]:
    """Both pages of a short study, connected."""
    protocol = load_protocol(str(write_plan(folder / "plan", ONE_TASK, IN_ORDER)))
    desk, cell = desk_of(open_study(folder / "study", protocol, 101, simulated=True))
    server = PageServer(desk, new_keys())
    server.listen("127.0.0.1", 0)
    desk.participant_url = server.url(Role.PARTICIPANT)
    desk.pages = lambda: server.live.count(Role.PARTICIPANT)
    timer = PeriodicCallback(desk.tick, 50)
    timer.start()
    async with tab(devtools) as participant, tab(devtools) as console:
        world = World(desk, cell, server, participant, console)
        await participant.open(server.url(Role.PARTICIPANT))
        await console.open(server.url(Role.EXPERIMENTER))
        await console.text("participant’s page open")
        yield world
        assert participant.complaints == [] and console.complaints == []
    timer.stop()
    await world.server.close()


@pytest.fixture
def visit(tmp_path, devtools) -> Callable[[Callable[[World], Coroutine]], None]:
    """Runs a scenario on fresh pages."""

    def play(scenario: Callable[[World], Coroutine]) -> None:
        async def whole() -> None:
            async with opened(tmp_path, devtools) as world:
                await scenario(world)

        asyncio.run(whole())

    return play


def test_a_whole_visit_by_clicks(visit):
    async def scenario(world: World) -> None:
        page, cell = world.participant, world.cell
        await world.begin()
        await page.text("Step 1 of 6")
        await world.check(page)
        await page.click("#continue")
        await world.at("start_demographics")
        await page.click("input[type=number]")
        await page.type("33")
        await page.click("label", "left")
        await page.until(SAVED % 2)
        await world.check(page)
        await page.click("#continue")
        await world.at("task_1")
        await world.console.click("#auto-start")
        await page.click("#continue", "I am ready")
        await world.console.text("starting")
        cell.play()
        await page.text("Your result")
        await page.text("-2")
        await world.check(page)
        await page.click("#continue")
        await world.at("task_1_after")
        for name in ("trust", "tired", "bored"):
            await page.click(f"[data-item={name}] label", "step 4")
        await page.until(SAVED % 3)
        await world.check(page)
        await page.click("#continue")
        await world.at("after_only_load")
        await page.click("[data-item=effort] label[title='65']")
        await page.click("[data-item=pick] label", "pace")
        await page.click("textarea")
        await page.type("all fine")
        await page.until(SAVED % 3)
        await world.check(page)
        await page.click("#continue")
        await world.at("end_1")
        await page.click("#continue")
        await page.text("Your visit is complete")
        await world.console.text("finished")

    visit(scenario)


def test_what_was_clicked_is_in_the_store(visit):
    async def scenario(world: World) -> None:
        await world.begin()
        await world.participant.click("#continue")
        await world.at("start_demographics")
        await world.participant.click("label", "right")
        await world.participant.click("input[type=number]")
        await world.participant.type("47")
        await world.participant.until(SAVED % 2)
        assert world.answers() == {"hand": "right", "age": 47}

    visit(scenario)


def test_a_whole_visit_by_keys_in_german(visit):
    async def scenario(world: World) -> None:
        page, cell = world.participant, world.cell
        await world.begin("de")
        await page.text("Schritt 1 von 6")
        await page.key("Enter")
        await world.at("start_demographics")
        await page.run("document.querySelector('input[type=number]').focus()")
        await page.type("28")
        await page.key("Tab")
        await page.key("Space")
        await page.key("ArrowRight")
        await page.until(SAVED % 2)
        await page.key("Enter")
        await world.at("task_1")
        await page.text("Würfel")
        await page.key("Enter")
        await page.text("Bitte warten Sie")
        world.desk.begin_task("task_1")
        cell.play()
        await page.text("Ihr Ergebnis")
        await page.until("!document.getElementById('continue').disabled")
        await page.key("Enter")
        await world.at("task_1_after")
        for digit in "524":
            await page.key(digit)
        await page.until(SAVED % 3)
        await page.key("Enter")
        await world.at("after_only_load")
        await page.run("document.querySelector('[data-item=effort] input').focus()")
        await page.key("6")
        await page.key("ArrowRight")
        await page.run("document.querySelector('[data-item=pick] input').focus()")
        await page.key("2")
        await page.until(SAVED % 2)
        await page.run("document.activeElement.blur()")
        await page.key("Enter")
        await page.text("ist ohne Antwort")
        await page.run("document.activeElement.blur()")
        await page.key("Enter")
        await world.at("end_1")
        await page.key("Enter")
        await page.text("Vielen Dank")
        told = world.answers()
        assert (told["age"], told["effort"], told["pick"], told["remark"]) == (28, 65, "pace", None)
        assert sorted(told[name] for name in ("trust", "tired", "bored")) == [2, 4, 5]

    visit(scenario)


def test_missing_answers_are_asked_for_once(visit):
    async def scenario(world: World) -> None:
        page = world.participant
        await world.begin()
        await page.click("#continue")
        await world.at("start_demographics")
        await page.click("label", "left")
        await page.until(SAVED % 1)
        await page.click("#continue")
        await page.text("One question has no answer")
        await page.until("document.querySelector('.missing').dataset.item === 'age'")
        await world.check(page)
        assert world.step == "start_demographics"
        await page.click("#continue")
        await world.at("task_1")
        assert world.answers() == {"hand": "left", "age": None}

    visit(scenario)


def test_a_refused_answer_is_told_beside_its_question(visit):
    async def scenario(world: World) -> None:
        page = world.participant
        await world.begin()
        await page.click("#continue")
        await world.at("start_demographics")
        await page.click("input[type=number]")
        await page.type("7")
        await page.until("document.querySelector('.refused .state').textContent.includes('16..99')")
        await world.check(page)

    visit(scenario)


def test_rules_vanish_and_every_placement_beeps(visit):
    async def scenario(world: World) -> None:
        page, cell = world.participant, world.cell
        await world.begin()
        await world.to_task()
        await page.click("#sound")
        await page.text("Sound is on")
        world.desk.begin_task("task_1")
        cell.show_rules(STROOP)
        await page.text("the colour of the letters counts")
        assert await page.run("document.querySelector('.word').textContent") == "RED"
        ink = await page.run("getComputedStyle(document.querySelector('.word')).color")
        assert ink == "rgb(42, 98, 201)"  # blue
        await world.check(page)
        cell.start()
        await page.text("Go!")
        assert await page.run("document.querySelectorAll('.word, .rules li').length") == 0
        beeps = int(await page.run("document.documentElement.dataset.beeps ?? 0"))
        for number, (colour, tray) in enumerate([(RED, "blue"), (GREEN, "red")], start=1):
            cell.place(colour, tray, right=number == 1)
            await page.text(f"{number} of 3 cubes placed")
            assert (
                await page.run("Number(document.documentElement.dataset.beeps)") == beeps + number
            )
        shown = await page.run("document.querySelector('.placements').innerText")
        assert "red cube" in shown and "blue tray" in shown
        marks = await page.run(
            "[...document.querySelectorAll('.placements li')].map((e) => e.className).join('')"
        )
        assert marks == ""
        await world.check(page)
        await page.click("#call")
        await page.text("The robot is called")

    visit(scenario)


def test_the_language_can_be_changed_and_stays(visit):
    async def scenario(world: World) -> None:
        page = world.participant
        await world.begin()
        await page.click("[data-language=de]")
        await page.text("Schritt 1 von 6")
        await page.text("Welcome (deutsch)")
        await page.click("#continue")
        await page.text("Schritt 2 von 6")
        await page.open(f"http://127.0.0.1:{world.server.port}/")
        await page.text("Schritt 2 von 6")

    visit(scenario)


def test_both_languages_have_the_same_words(visit):
    async def scenario(world: World) -> None:
        script = """import("/texts.js").then(({ TEXTS }) => {
          const keys = (o) => Object.entries(o).map(([key, value]) =>
            value && typeof value === "object" ? [key, keys(value)] : [key, typeof value]);
          return [JSON.stringify(keys(TEXTS.en)), JSON.stringify(keys(TEXTS.de))];
        })"""
        english, german = await world.participant.run(script)
        assert english == german

    visit(scenario)


def test_a_tablet_is_enough(visit):
    async def scenario(world: World) -> None:
        page = world.participant
        await page.size(820, 1180, touch=True)
        await world.begin()
        await page.click("#continue", touch=True)
        await world.at("start_demographics")
        await page.click("label", "left", touch=True)
        await page.until(SAVED % 1)
        await world.check(page)
        small = """[...document.querySelectorAll("button, .question label:has(input)")]
          .filter((e) => e.checkVisibility() && e.getBoundingClientRect().height < 32).length"""
        assert await page.run(small) == 0

    visit(scenario)


def test_what_was_typed_when_the_connection_broke_arrives(visit):
    async def scenario(world: World) -> None:
        page, port, keys = world.participant, world.server.port, world.server.keys
        await world.begin()
        await page.click("#continue")
        await world.at("start_demographics")
        await page.click("input[type=number]")
        await page.type("52")
        await world.server.close()
        await page.text("Connection lost")
        await world.console.text("connection lost")
        assert not await page.run("document.getElementById('screen').checkVisibility({"
                                  "visibilityProperty: true})")  # fmt: skip
        assert "age" not in world.answers()
        world.server = PageServer(world.desk, keys)
        world.server.listen("127.0.0.1", port)
        await page.until(SAVED % 1)
        assert world.answers() == {"age": 52}
        await page.until("!document.body.innerText.includes('Connection lost')")

    visit(scenario)


def test_the_console_stops_at_once_and_releases_after_a_question(visit):
    async def scenario(world: World) -> None:
        page, cell = world.console, world.cell
        await page.click("#stop")
        await page.click("#release")
        await page.text("Release the robot?")
        await page.click("#stop")  # within reach, whatever is asked
        await page.click("#dialog button", "Back")
        await page.until("!document.getElementById('dialog').open")
        await page.click("#release")
        await page.click("#dialog-yes", "Release")
        await page.until("!document.getElementById('dialog').open")
        cell.refuse["stop"] = "safety/stop does not answer."
        await page.click("#stop")
        await page.text("safety/stop does not answer.")
        assert [name for name, _ in cell.commands] == ["stop", "stop", "release", "stop"]
        await world.check(page)

    visit(scenario)


def test_the_console_runs_the_visit(visit):
    async def scenario(world: World) -> None:
        page, desk = world.console, world.desk
        fill(world.cell.news)
        await world.begin()
        await page.text("needs help")
        await page.text("deadline missed")
        await page.click("#pause")
        await world.participant.text("A short break")
        await page.click("#resume")
        await world.participant.until("document.getElementById('cover').hidden")
        await world.to_task()
        await page.click("#begin-task")
        await page.text("starting")
        world.cell.show_rules()
        await page.text("shows rules")
        await page.click("#abort-task")
        await page.click("#dialog-reason")
        await page.type("a cube fell down")
        await page.click("#dialog-yes")
        await page.until("!document.getElementById('dialog').open")
        world.cell.abort()
        await page.text("a cube fell down")
        await world.participant.text("It will be repeated")
        await page.click("#note")
        await page.type("left hand")
        await page.key("Enter")
        await page.until("document.getElementById('notes').innerText.includes('left hand')")
        await world.check(page)
        await page.click("#abort-visit")
        await page.click("#dialog-reason")
        await page.type("felt unwell")
        await page.click("#dialog-yes")
        await world.participant.text("The visit has ended")
        assert desk.participant()["visit"]["status"] == "aborted"

    visit(scenario)


def test_nothing_is_fetched_from_elsewhere(visit):
    async def scenario(world: World) -> None:
        for page in (world.participant, world.console):
            fetched = await page.run("performance.getEntriesByType('resource').map((e) => e.name)")
            assert fetched
            assert all(
                name.startswith(f"http://127.0.0.1:{world.server.port}/") for name in fetched
            )
            blocked = "fetch('http://localhost:1/').then(() => 'fetched', () => 'blocked')"
            assert await page.run(blocked) == "blocked"
            assert page.complaints
            assert all("Content Security Policy" in words for words in page.complaints)
            page.complaints.clear()

    visit(scenario)


def test_without_a_token_the_page_is_closed(visit):
    async def scenario(world: World) -> None:
        page = world.participant
        await page.send("Network.clearBrowserCookies")
        await page.open(f"http://127.0.0.1:{world.server.port}/console")
        await page.text("This page is closed")
        await world.check(page)

    visit(scenario)


def test_the_token_leaves_the_address_bar(visit):
    async def scenario(world: World) -> None:
        for page in (world.participant, world.console):
            assert "token" not in await page.run("location.href")
            assert json.dumps(world.server.keys.experimenter) not in await page.run(
                "JSON.stringify([document.cookie, {...localStorage}, {...sessionStorage}])"
            )

    visit(scenario)
