# SPDX-License-Identifier: BSD-3-Clause
"""Live data for the pages: what has changed since a page was last told, ten times a second at most.

A page gets everything when it connects, then only the sections that differ. One that reads too
slowly misses steps on the way, never the newest state. A page that hears nothing for some seconds
can take the connection for lost: something is sent every second.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any

from tornado.concurrent import Future
from tornado.ioloop import PeriodicCallback
from tornado.websocket import WebSocketClosedError

from fabric_study.web.access import Role

PERIOD_MS = 100
QUIET_TICKS = 10  # without news, after which a page is told that we are still there
MOST_PAGES = 16


class Page:
    """One connected page: what it was told, and whether it has taken it."""

    def __init__(
        self, role: Role, write: Callable[[str], Future], close: Callable[[], None]
    ) -> None:
        self.role = role
        self.close = close
        self._write = write
        self._told: dict[str, str] = {}
        self._written: Future | None = None
        self._quiet = 0

    def tell(self, sections: Mapping[str, str]) -> None:
        """Send the sections (JSON by name) that differ from what the page has."""
        if self._written is not None and not self._written.done():
            return
        news = {name: text for name, text in sections.items() if self._told.get(name) != text}
        self._quiet = 0 if news else self._quiet + 1
        if not news and self._quiet < QUIET_TICKS:
            return
        self._quiet = 0
        body = ",".join(f"{json.dumps(name)}:{text}" for name, text in news.items())
        try:
            self._written = self._write("{" + body + "}")
        except WebSocketClosedError:
            return
        self._told.update(news)


class Live:
    """All connected pages."""

    def __init__(self, sources: Mapping[Role, Callable[[], Mapping[str, Any]]]) -> None:
        """sources: for each role what its page shows, by section."""
        self._sources = sources
        self._pages: set[Page] = set()
        self._timer = PeriodicCallback(self.tick, PERIOD_MS)

    def start(self) -> None:
        """Begin to tell the pages, on the running IOLoop."""
        self._timer.start()

    def stop(self) -> None:
        """End it, and let go of all pages."""
        self._timer.stop()
        for page in self._pages:
            page.close()

    def add(self, page: Page) -> None:
        """Take in a page."""
        self._pages.add(page)

    def remove(self, page: Page) -> None:
        """Forget a page."""
        self._pages.discard(page)

    @property
    def full(self) -> bool:
        """Whether no further page can be taken in."""
        return len(self._pages) >= MOST_PAGES

    def count(self, role: Role) -> int:
        """Return how many pages of this role are connected."""
        return sum(page.role == role for page in self._pages)

    def tick(self) -> None:
        """Tell every page what has changed."""
        for role, source in self._sources.items():
            pages = [page for page in self._pages if page.role == role]
            if not pages:
                continue
            sections = {name: _json(value) for name, value in source().items()}
            for page in pages:
                page.tell(sections)


def _json(value: Any) -> str:
    return json.dumps(value, allow_nan=False, separators=(",", ":"))
