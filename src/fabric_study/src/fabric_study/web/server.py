# SPDX-License-Identifier: BSD-3-Clause
"""The web server: pages, requests, live sockets. Knows the study only as a `Desk`.

    server = PageServer(desk, kept_keys(path))
    server.listen(address, port)                  # on the running IOLoop

Nothing is served but the files of FILES, and nothing is fetched from elsewhere. Whatever changes
something is a POST with a cookie of sufficient role, from a page of this server (XSRF token).
Errors are JSON, {"error": "a sentence"}.
"""

import http.client
import inspect
import logging
from pathlib import Path
from typing import Any

from tornado.concurrent import Future
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketHandler

from fabric_study.web.access import Keys, Role, host_allowed
from fabric_study.web.desk import COMMANDS, Desk, Refused, parsed
from fabric_study.web.live import Live, Page

LARGEST_BODY = 16 * 1024  # bytes of a request that is answered with a sentence; beyond is cut off
LARGEST_READ = 64 * 1024
LARGEST_MESSAGE = 256  # bytes from a live socket; pages only listen
PING = 5.0  # s
FILES = {  # everything there is to fetch
    "style.css": "text/css",
    "participant.css": "text/css",
    "console.css": "text/css",
    "common.js": "text/javascript",
    "texts.js": "text/javascript",
    "task.js": "text/javascript",
    "questions.js": "text/javascript",
    "participant.js": "text/javascript",
    "console.js": "text/javascript",
    "icon.svg": "image/svg+xml",
}
PAGES = {
    "/": (Role.PARTICIPANT, "participant.html"),
    "/console": (Role.EXPERIMENTER, "console.html"),
}
CLOSED = "closed.html"
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; object-src 'none'",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}

logger = logging.getLogger(__name__)


class PageServer:
    """The server of one study."""

    def __init__(self, desk: Desk, keys: Keys, folder: Path | None = None) -> None:
        """folder: where the files lie, by default the package's.

        Raises OSError when one of them is missing.
        """
        folder = folder or default_folder()
        names = [*FILES, CLOSED, *(file for _, file in PAGES.values())]
        self.files = {name: (folder / name).read_bytes() for name in names}
        self.desk, self.keys = desk, keys
        self.live = Live({Role.PARTICIPANT: desk.participant, Role.EXPERIMENTER: desk.console})
        self.address, self.port = "", 0
        self._server: HTTPServer | None = None

    def listen(self, address: str, port: int) -> int:
        """Serve on the running IOLoop; return the port, which is a free one if `port` is 0.

        Raises OSError when the address or the port cannot be had.
        """
        sockets = bind_sockets(port, address)
        self.address, self.port = address, sockets[0].getsockname()[1]
        self._server = HTTPServer(self.application(), max_body_size=LARGEST_READ)
        self._server.add_sockets(sockets)
        self.live.start()
        return self.port

    async def close(self) -> None:
        """Take no further request and let go of the pages."""
        self.live.stop()
        if self._server is not None:
            self._server.stop()
            await self._server.close_all_connections()

    def application(self) -> Application:
        """Return the Tornado application."""
        served = {"server": self}
        routes: list[tuple] = [(path, PageHandler, served) for path in PAGES]
        routes += [(rf"/({name})", FileHandler, served) for name in FILES]
        routes += [(r"/api/(\w+)", CommandHandler, served), (r"/live/(\w+)", LiveHandler, served)]
        return Application(
            routes,
            default_handler_class=MissingHandler,
            default_handler_args=served,
            xsrf_cookies=True,
            xsrf_cookie_kwargs={"samesite": "Strict"},
            websocket_ping_interval=PING,
            websocket_max_message_size=LARGEST_MESSAGE,
            log_function=lambda handler: None,
        )

    def url(self, role: Role) -> str:
        """Return the address that opens the page of a role."""
        host = f"[{self.address}]" if ":" in self.address else self.address
        path = {allowed: path for path, (allowed, _) in PAGES.items()}[role]
        token = {
            Role.PARTICIPANT: self.keys.participant,
            Role.EXPERIMENTER: self.keys.experimenter,
        }[role]
        return f"http://{host}:{self.port}{path}?token={token}"

    def cookie(self, role: Role) -> str:
        """Return the name of a role's cookie: one browser may have both pages open, and cookies
        know no ports, so that two studies may run side by side."""
        return f"fabric_{role.name.lower()}_{self.port}"


class _Handler(RequestHandler):
    """What all requests have in common: headers, the host, the role, errors as JSON."""

    def initialize(self, server: PageServer) -> None:
        self._study = server

    def set_default_headers(self) -> None:
        self.clear_header("Server")
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        if not host_allowed(self._study.address, self.request.host):
            raise Refused("This address is not one of this server.", 403)
        if len(self.request.body) > LARGEST_BODY:
            raise Refused(f"The request is larger than {LARGEST_BODY} bytes.", 413)

    def check_xsrf_cookie(self) -> None:
        try:
            super().check_xsrf_cookie()
        except HTTPError:
            raise Refused("The request does not come from a page of this server.", 403) from None

    def role(self) -> Role:
        """Return the most that this visitor's cookies allow."""
        shown = [self.get_cookie(self._study.cookie(role), "") or "" for role in Role]
        return max(map(self._study.keys.role, shown))

    def require(self, role: Role) -> None:
        """Raise Refused unless the visitor has at least this role."""
        if self.role() < role:
            raise Refused("Open the address that the program has printed, with its token.", 403)

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        error = kwargs.get("exc_info", (None, None))[1]
        reason = http.client.responses.get(status_code, "the request failed")
        if isinstance(error, HTTPError) and error.log_message:
            reason = error.log_message
        self.finish({"error": reason})

    def log_exception(self, kind: Any, value: Any, trace: Any) -> None:
        if not isinstance(value, (HTTPError, Refused)):
            super().log_exception(kind, value, trace)

    def _handle_request_exception(self, error: BaseException) -> None:
        if isinstance(error, Refused) and not self._finished:
            self.set_status(error.status)
            self.finish({"error": str(error)})
        else:
            super()._handle_request_exception(error)


class PageHandler(_Handler):
    """A page, for those with a cookie; with the token in the address, the cookie."""

    def get(self) -> None:
        role, file = PAGES[self.request.path]
        token = self.get_query_argument("token", None)
        if token is not None and self._study.keys.role(token) >= role:
            options = {"httponly": True, "samesite": "Strict"}
            self.set_cookie(self._study.cookie(self._study.keys.role(token)), token, **options)
            self.redirect(self.request.path)
            return
        if self.role() < role:
            self.set_status(403)
            file = CLOSED
        self.xsrf_token  # noqa: B018  reading it sets the cookie that requests are checked against
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.finish(self._study.files[file])


class FileHandler(_Handler):
    """A file that pages consist of; it holds no secret."""

    def get(self, name: str) -> None:
        self.set_header("Content-Type", f"{FILES[name]}; charset=utf-8")
        self.finish(self._study.files[name])


class CommandHandler(_Handler):
    """A page asks for something."""

    async def post(self, name: str) -> None:
        command = COMMANDS.get(name)
        if command is None:
            raise Refused(f"There is no request '{name:.40}'.", 404)
        self.require(command.role)
        kind = self.request.headers.get("Content-Type", "").partition(";")[0].strip()
        if kind != "application/json":
            raise Refused("A request must be application/json.", 415)
        fields = parsed(command, self.request.body)
        try:
            answer = getattr(self._study.desk, name)(**fields)
            if inspect.isawaitable(answer):
                answer = await answer
        except ValueError as error:
            raise Refused(str(error), 400) from error
        self.finish({"answer": answer})


class LiveHandler(_Handler, WebSocketHandler):
    """What changes, for a page that is open."""

    _page: Page | None = None

    def prepare(self) -> None:
        super().prepare()
        roles = {"participant": Role.PARTICIPANT, "console": Role.EXPERIMENTER}
        role = roles.get(self.path_args[0])
        if role is None:
            raise Refused("There is no such socket.", 404)
        self.require(role)
        if not self.check_origin(self.request.headers.get("Origin", "")):
            raise Refused("Sockets are for pages of this server only.", 403)
        if self._study.live.full:
            raise Refused("Too many pages are open.", 503)
        self._shown = role

    def check_origin(self, origin: str) -> bool:
        return origin == f"{self.request.protocol}://{self.request.host}"

    def open(self, *_: str) -> None:
        self._page = Page(self._shown, self._send, self.close)
        self._study.live.add(self._page)

    def _send(self, text: str) -> Future:
        return self.write_message(text)

    def on_message(self, message: str | bytes) -> None:
        self.close(1003, "nothing is taken here")

    def on_close(self) -> None:
        if self._page is not None:
            self._study.live.remove(self._page)


class MissingHandler(_Handler):
    """Everything else."""

    def prepare(self) -> None:
        super().prepare()
        raise Refused("There is nothing here.", 404)


def default_folder() -> Path:
    """Return the folder of the pages' files, in the source tree or installed."""
    here = Path(__file__).resolve()
    candidates = [place / "web" for place in here.parents[2:5]]
    candidates += [place / "share" / "fabric_study" / "web" for place in here.parents]
    for candidate in candidates:
        if (candidate / "participant.html").is_file():
            return candidate
    raise FileNotFoundError(f"no participant.html in {' nor '.join(map(str, candidates))}")
