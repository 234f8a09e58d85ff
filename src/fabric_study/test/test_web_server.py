# SPDX-License-Identifier: BSD-3-Clause
"""Who gets in, what is refused and with which words. No browser, no study: a desk that notes."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from tornado.httpclient import HTTPClientError, HTTPRequest, HTTPResponse
from tornado.testing import AsyncHTTPTestCase, gen_test
from tornado.websocket import websocket_connect

from fabric_study.web.access import Keys, Role
from fabric_study.web.desk import COMMANDS, LARGEST_TEXT, Refused
from fabric_study.web.live import MOST_PAGES
from fabric_study.web.server import (
    CLOSED,
    FILES,
    LARGEST_BODY,
    LARGEST_MESSAGE,
    PAGES,
    PageServer,
)

KEYS = Keys(participant="p" * 32, experimenter="e" * 32)
ANSWER = {"person": "K7QF2M", "step": "s1", "item": "tedious", "value": 4}


class NotingDesk:
    """Takes everything for the step s1 and notes it."""

    def __init__(self) -> None:
        self.taken: list[tuple[str, dict[str, Any]]] = []
        self.news: dict[str, Any] = {"step": {"id": "s1"}}

    def participant(self) -> dict[str, Any]:
        return self.news

    def console(self) -> dict[str, Any]:
        return {**self.news, "secret": "for the experimenter"}

    def answer(self, person: str, step: str, item: str, value: Any) -> str:
        if step != "s1":
            raise Refused("The visit has moved on.")
        if item != "tedious":
            raise ValueError(f"item {item!r} is not asked in this step")
        self.taken.append(("answer", {"item": item, "value": value}))
        return "saved"

    async def stop(self) -> None:
        self.taken.append(("stop", {}))

    def pause(self) -> None:
        raise RuntimeError("a bug")


class ServerCase(AsyncHTTPTestCase):
    """A server on loopback with files that hold their own names."""

    def get_app(self):
        self._folder = tempfile.TemporaryDirectory()
        self.addCleanup(self._folder.cleanup)
        for name in [*FILES, CLOSED, *(file for _, file in PAGES.values())]:
            (Path(self._folder.name) / name).write_text(f"this is {name}")
        self.desk = NotingDesk()
        self.server = PageServer(self.desk, KEYS, Path(self._folder.name))
        self.server.address, self.server.port = "127.0.0.1", self.get_http_port()
        return self.server.application()

    def ask(self, path: str, **options: Any) -> HTTPResponse:
        return self.fetch(path, follow_redirects=False, **options)

    def headers(self, role: Role) -> dict[str, str]:
        """What a page of this role sends with a request."""
        token = {Role.NOBODY: "x", Role.PARTICIPANT: "p" * 32, Role.EXPERIMENTER: "e" * 32}[role]
        return {
            "Cookie": f"{self.server.cookie(role)}={token}; _xsrf=abcdef",
            "X-XSRFToken": "abcdef",
            "Content-Type": "application/json",
        }

    def post(self, name: str, content: Any, role: Role = Role.PARTICIPANT, **headers: str):
        body = content if isinstance(content, (str, bytes)) else json.dumps(content)
        sent = {name: text for name, text in (self.headers(role) | headers).items() if text}
        return self.ask(f"/api/{name}", method="POST", body=body, headers=sent)

    def refused(self, response: HTTPResponse, code: int) -> str:
        """The sentence of a refusal; nothing may have reached the desk."""
        assert response.code == code, response.body
        assert self.desk.taken == []
        sentence = json.loads(response.body)["error"]
        assert sentence[0].isupper() or sentence[0] == "i"
        return sentence


class TestPages(ServerCase):
    def test_the_token_in_the_address_becomes_a_cookie_scripts_cannot_read(self):
        for path, token in (("/", KEYS.participant), ("/console", KEYS.experimenter)):
            response = self.ask(f"{path}?token={token}")
            assert (response.code, response.headers["Location"]) == (302, path)
            cookie = response.headers["Set-Cookie"]
            assert token in cookie and "HttpOnly" in cookie and "SameSite=Strict" in cookie
            assert "token" not in response.headers["Location"]

    def test_pages_open_for_their_role_only(self):
        for path, role, code in (
            ("/", Role.NOBODY, 403),
            ("/", Role.PARTICIPANT, 200),
            ("/", Role.EXPERIMENTER, 200),
            ("/console", Role.NOBODY, 403),
            ("/console", Role.PARTICIPANT, 403),
            ("/console", Role.EXPERIMENTER, 200),
        ):
            response = self.ask(path, headers=self.headers(role))
            assert response.code == code, (path, role)
            shown = PAGES[path][1] if code == 200 else CLOSED
            assert response.body.decode() == f"this is {shown}"

    def test_one_browser_can_have_both_pages(self):
        both = [self.headers(role)["Cookie"] for role in (Role.PARTICIPANT, Role.EXPERIMENTER)]
        names = {cookie.split("=")[0] for cookie in both}
        assert len(names) == 2
        assert self.ask("/console", headers={"Cookie": "; ".join(both)}).code == 200

    def test_a_wrong_token_and_the_other_pages_token_open_nothing(self):
        assert self.ask("/console?token=" + KEYS.participant).code == 403
        assert self.ask("/?token=guess").code == 403
        assert self.ask("/?token=%C3%A4").code == 403

    def test_every_answer_forbids_what_is_not_from_here(self):
        for path in ("/", "/style.css", "/nothing", "/api/stop"):
            headers = self.ask(path).headers
            assert headers["Content-Security-Policy"].startswith("default-src 'self'")
            assert headers["X-Content-Type-Options"] == "nosniff"
            assert headers["Cache-Control"] == "no-store"

    def test_no_path_leads_out_of_the_files(self):
        for path in (
            "/../server.py",
            "/..%2f..%2fetc/passwd",
            "/%2e%2e/%2e%2e/etc/passwd",
            "/style.css/../../server.py",
            "//etc/passwd",
            "/participant.html",
            "/style.css%00.js",
        ):
            response = self.ask(path, headers=self.headers(Role.EXPERIMENTER))
            assert response.code in (400, 404), path
        assert self.ask("/style.css").body == b"this is style.css"

    def test_another_sites_name_for_this_machine_is_refused(self):
        response = self.ask("/", headers={"Host": "evil.example"})
        assert "address" in self.refused(response, 403)


class TestRequests(ServerCase):
    def test_an_answer_reaches_the_desk_and_comes_back(self):
        response = self.post("answer", ANSWER)
        assert json.loads(response.body) == {"answer": "saved"}
        assert self.desk.taken == [("answer", {"item": "tedious", "value": 4})]

    def test_a_participant_can_do_nothing_of_the_experimenters(self):
        for name, command in COMMANDS.items():
            if command.role == Role.EXPERIMENTER:
                self.refused(self.post(name, {}), 403)
        assert self.post("stop", {}, Role.EXPERIMENTER).code == 200
        assert self.desk.taken == [("stop", {})]

    def test_without_a_cookie_nothing_is_taken(self):
        assert "token" in self.refused(self.post("answer", ANSWER, Role.NOBODY), 403)

    def test_every_request_without_the_pages_xsrf_token_is_refused(self):
        for name in COMMANDS:
            sentence = self.refused(self.post(name, {}, **{"X-XSRFToken": ""}), 403)
            assert "page of this server" in sentence
            self.refused(self.post(name, {}, **{"X-XSRFToken": "other"}), 403)

    def test_another_step_is_refused_with_the_desks_words(self):
        sentence = self.refused(self.post("answer", ANSWER | {"step": "s0"}), 409)
        assert sentence == "The visit has moved on."

    def test_what_the_study_refuses_is_told(self):
        sentence = self.refused(self.post("answer", ANSWER | {"item": "age"}), 400)
        assert sentence == "item 'age' is not asked in this step"

    def test_wrong_types_are_refused_by_the_name_of_the_field(self):
        for field, value in (
            ("step", 3),
            ("item", None),
            ("value", True),
            ("value", [1]),
            ("value", "x" * (LARGEST_TEXT + 1)),
            ("value", 1e12),
        ):
            assert f"'{field}'" in self.refused(self.post("answer", ANSWER | {field: value}), 400)
        assert "'more'" in self.refused(self.post("answer", ANSWER | {"more": 1}), 400)
        assert "'value'" in self.refused(
            self.post("answer", {"person": "p", "step": "s1", "item": "i"}), 400
        )

    def test_what_is_no_json_object_is_refused(self):
        for body in ("", "{", "[]", '"text"', '{"value": NaN}', b"\xff", "[" * 5000):
            self.refused(self.post("answer", body), 400)

    def test_other_content_types_are_refused(self):
        self.refused(self.post("answer", ANSWER, **{"Content-Type": "text/plain"}), 415)

    def test_a_request_that_is_too_large_is_refused(self):
        sentence = self.refused(self.post("answer", " " * (LARGEST_BODY + 1)), 413)
        assert str(LARGEST_BODY) in sentence

    def test_unknown_requests_and_reading_by_request_are_refused(self):
        self.refused(self.post("dance", {}), 404)
        self.refused(self.post("participant", {}), 404)
        self.refused(self.ask("/api/answer", headers=self.headers(Role.PARTICIPANT)), 405)

    def test_a_bug_is_told_without_its_inside(self):
        response = self.post("pause", {}, Role.EXPERIMENTER)
        assert response.code == 500
        assert "bug" not in response.body.decode()


class TestLive(ServerCase):
    def connect(self, path: str, role: Role, **headers: str):
        origin = f"http://127.0.0.1:{self.get_http_port()}"
        url = f"ws://127.0.0.1:{self.get_http_port()}/live/{path}"
        sent = {"Cookie": f"{self.headers(role)['Cookie']}", "Origin": origin} | headers
        sent = {name: text for name, text in sent.items() if text}
        return websocket_connect(HTTPRequest(url, headers=sent))

    async def code_of(self, path: str, role: Role, **headers: str) -> int:
        try:
            (await self.connect(path, role, **headers)).close()
        except HTTPClientError as error:
            return error.code
        return 101

    @gen_test
    async def test_sockets_open_for_pages_of_this_server_only(self):
        port = self.get_http_port()
        assert await self.code_of("participant", Role.PARTICIPANT) == 101
        assert await self.code_of("console", Role.EXPERIMENTER) == 101
        assert await self.code_of("participant", Role.NOBODY) == 403
        assert await self.code_of("console", Role.PARTICIPANT) == 403
        assert await self.code_of("other", Role.EXPERIMENTER) == 404
        for origin in ("", "null", "http://evil.example", f"https://127.0.0.1:{port}"):
            assert await self.code_of("participant", Role.PARTICIPANT, Origin=origin) == 403

    @gen_test
    async def test_a_page_is_told_everything_then_what_changes(self):
        socket = await self.connect("participant", Role.PARTICIPANT)
        self.desk.news = {"step": {"id": "s1"}, "visit": {"person": "K7QF2M"}}
        self.server.live.tick()
        assert json.loads(await socket.read_message()) == self.desk.news
        self.desk.news = {"step": {"id": "s2"}, "visit": {"person": "K7QF2M"}}
        self.server.live.tick()
        assert json.loads(await socket.read_message()) == {"step": {"id": "s2"}}

    @gen_test
    async def test_a_participants_page_is_not_told_what_is_the_experimenters(self):
        socket = await self.connect("participant", Role.PARTICIPANT)
        console = await self.connect("console", Role.EXPERIMENTER)
        self.server.live.tick()
        assert "secret" not in json.loads(await socket.read_message())
        assert "secret" in json.loads(await console.read_message())

    @gen_test
    async def test_without_news_a_page_hears_that_the_server_is_there(self):
        socket = await self.connect("participant", Role.PARTICIPANT)
        self.server.live.start()
        await socket.read_message()
        assert json.loads(await socket.read_message()) == {}
        self.server.live.stop()

    @gen_test
    async def test_a_socket_that_speaks_or_is_too_large_is_closed(self):
        for message in ("hello", "x" * (LARGEST_MESSAGE + 1)):
            socket = await self.connect("participant", Role.PARTICIPANT)
            await socket.write_message(message)
            assert await socket.read_message() is None

    @gen_test
    async def test_there_is_a_limit_to_open_pages(self):
        sockets = [await self.connect("participant", Role.PARTICIPANT) for _ in range(MOST_PAGES)]
        assert await self.code_of("participant", Role.PARTICIPANT) == 503
        sockets[0].close()
        assert await sockets[0].read_message() is None
        assert await self.code_of("participant", Role.PARTICIPANT) == 101
