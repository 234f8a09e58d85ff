# SPDX-License-Identifier: BSD-3-Clause
"""The page that drives the simulated person: buttons and keys in a browser of this machine.

    app = make_app(desk, token)                   # http://localhost:PORT/TOKEN/

Whoever has no token gets nothing. A page of somebody else cannot send commands either: the name in
the address bar must be that of this machine (no rebinding of names), a command must be JSON and
come from this page.
"""

from __future__ import annotations

import asyncio
import hmac
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

from aiohttp import web

HOSTS = ("localhost", "127.0.0.1", "::1")
PERIOD = 0.1  # s between looks for news
LARGEST_COMMAND = 1024  # bytes
FILES = {  # what the page consists of; nothing else is served
    "": ("manual.html", "text/html"),
    "manual.css": ("manual.css", "text/css"),
    "manual.js": ("manual.js", "text/javascript"),
}
POLICY = "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'"
HEADERS = {
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]
CLOSING = "closing"  # key of the event that ends the streams


class Desk(Protocol):
    """What stands behind the page."""

    def snapshot(self) -> dict[str, Any]:
        """What there is to see, ready for JSON."""

    async def command(self, name: str, container: str) -> tuple[bool, str]:
        """Pass a command on; whether it was accepted, and why not."""


def make_app(desk: Desk, token: str, folder: Path | None = None) -> web.Application:
    """Return the application; `token` is the first part of every path.

    folder: where FILES lie, by default the package's. Raises OSError when one of them is missing.
    """
    app = web.Application(middlewares=[_guard(token)], client_max_size=LARGEST_COMMAND)
    app[CLOSING] = asyncio.Event()
    app.on_shutdown.append(_close)
    folder = folder or default_folder()
    for name, (file, kind) in FILES.items():
        app.router.add_get(f"/{token}/{name}", _file(folder / file, kind))
    app.router.add_get(f"/{token}/events", _events(desk))
    app.router.add_post(f"/{token}/command", _command(desk))
    return app


def default_folder() -> Path:
    """Folder of the page's files, in the source tree or installed."""
    candidates = [place / "web" for place in Path(__file__).resolve().parents[2:6]]
    candidates += [place / "share/fabric_sim/web" for place in Path(__file__).resolve().parents]
    for candidate in candidates:
        if (candidate / "manual.html").is_file():
            return candidate
    raise FileNotFoundError(f"no manual.html in {' nor '.join(map(str, candidates))}")


def _guard(token: str) -> Callable[[web.Request, Handler], Awaitable[web.StreamResponse]]:
    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        if urlsplit(f"//{request.host}").hostname not in HOSTS:
            raise web.HTTPForbidden(text="this page is for this machine only", headers=HEADERS)
        first = request.path.removeprefix("/").partition("/")[0]
        if not hmac.compare_digest(first.encode(), token.encode()):
            raise web.HTTPNotFound(text="no such page", headers=HEADERS)
        if request.method != "GET" and request.headers.get("Origin") != f"http://{request.host}":
            raise web.HTTPForbidden(text="commands come from the page only", headers=HEADERS)
        try:
            return await handler(request)
        except web.HTTPException as error:
            error.headers.update(HEADERS)
            raise

    return guard


def _file(path: Path, kind: str) -> Handler:
    text = path.read_text(encoding="utf-8")

    async def serve(_: web.Request) -> web.Response:
        return web.Response(text=text, content_type=kind, headers=HEADERS)

    return serve


def _command(desk: Desk) -> Handler:
    async def take(request: web.Request) -> web.Response:
        if request.content_type != "application/json":
            raise web.HTTPUnsupportedMediaType(text="a command is application/json")
        name, container = _parsed(await request.text())
        accepted, reason = await desk.command(name, container)
        return web.json_response({"accepted": accepted, "reason": reason}, headers=HEADERS)

    return take


def _parsed(text: str) -> tuple[str, str]:
    try:
        content = json.loads(text)
    except ValueError as error:
        raise web.HTTPBadRequest(text=f"the command is not JSON: {error}") from None
    known = isinstance(content, dict) and set(content) <= {"name", "container"}
    if not known or not all(isinstance(value, str) for value in content.values()):
        raise web.HTTPBadRequest(text="a command has the texts name and container")
    if "name" not in content:
        raise web.HTTPBadRequest(text="the command has no name")
    return content["name"], content.get("container", "")


def _events(desk: Desk) -> Handler:
    """Server-sent events: a snapshot whenever it is another than the last one."""

    async def stream(request: web.Request) -> web.StreamResponse:
        response = web.StreamResponse(headers=HEADERS | {"Content-Type": "text/event-stream"})
        await response.prepare(request)
        closing, told = request.app[CLOSING], None
        while not closing.is_set():
            news = json.dumps(desk.snapshot())
            if news != told:
                told = news
                await response.write(f"data: {news}\n\n".encode())
            try:
                await asyncio.wait_for(closing.wait(), PERIOD)
            except TimeoutError:
                continue
        return response

    return stream


async def _close(app: web.Application) -> None:
    app[CLOSING].set()
