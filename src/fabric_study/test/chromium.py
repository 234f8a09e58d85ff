# SPDX-License-Identifier: BSD-3-Clause
"""Debian's Chromium without a window, driven over its DevTools protocol: real clicks and keys."""

from __future__ import annotations

import asyncio
import base64
import json
import subprocess
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

from tornado.websocket import WebSocketClientConnection, websocket_connect

PATIENCE = 60.0  # s, wall time after which something that should come is missed
LARGEST_ANSWER = 64 * 1024 * 1024  # bytes; a screenshot is one
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
    "--disable-sync", "--hide-scrollbars", "--mute-audio", "--no-proxy-server",
    "--remote-debugging-port=0",
)  # fmt: skip
KEYS = {  # name: (code, virtual key code, text)
    "Enter": ("Enter", 13, "\r"),
    "Tab": ("Tab", 9, ""),
    "ArrowRight": ("ArrowRight", 39, ""),
    "ArrowLeft": ("ArrowLeft", 37, ""),
    "Space": ("Space", 32, " "),
}
FIND = """(() => {
  const found = [...document.querySelectorAll(%s)].find((e) => e.textContent.includes(%s));
  if (!found) return null;
  found.scrollIntoView({ block: "center", behavior: "instant" });
  const box = found.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
})()"""
UNTIL = """new Promise((done) => {
  const look = () => {
    let value = null;
    try { value = %s; } catch (error) { value = null; }
    if (value) done(value); else setTimeout(look, 20);
  };
  look();
})"""


@contextmanager
def chromium(folder: Path) -> Iterator[str]:
    """A browser with an empty profile in a folder; the address of its DevTools socket."""
    command = ["chromium", *OPTIONS, f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace"
    )
    told = []
    try:
        for line in process.stderr:
            told.append(line)
            if line.startswith("DevTools listening on "):
                yield line.split()[-1]
                return
        raise AssertionError(f"chromium does not start: {''.join(told)}")
    finally:
        process.kill()
        process.communicate()


class Tab:
    """One page of the browser.

    complaints: what it says of scripts and of the page's security policy; not of answers that
    refuse a request.
    """

    def __init__(self, socket: WebSocketClientConnection, session: str) -> None:
        self._socket, self._session = socket, session
        self._waiting: dict[int, asyncio.Future] = {}
        self._count = 100
        self.complaints: list[str] = []

    async def listen(self) -> None:
        """Hand out what the browser says, until it is closed."""
        while (text := await self._socket.read_message()) is not None:
            message = json.loads(text)
            if "id" in message and message["id"] in self._waiting:
                self._waiting.pop(message["id"]).set_result(message)
            elif message.get("method") == "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(message["params"]["exceptionDetails"]))
            elif message.get("method") == "Log.entryAdded":
                entry = message["params"]["entry"]
                if entry["level"] == "error" and entry["source"] != "network":
                    self.complaints.append(f"{entry['text']} {entry.get('url', '')}")

    async def send(self, method: str, **params: Any) -> dict[str, Any]:
        """Ask the browser; what it answers."""
        self._count += 1
        answer = self._waiting[self._count] = asyncio.get_running_loop().create_future()
        request = {"id": self._count, "sessionId": self._session, "method": method}
        await self._socket.write_message(json.dumps({**request, "params": params}))
        message = await asyncio.wait_for(answer, PATIENCE)
        if "error" in message:
            raise AssertionError(f"{method}: {message['error']}")
        return message["result"]

    async def run(self, script: str) -> Any:
        """The value of an expression in the page."""
        told = await self.send(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in told, (script, told)
        return told["result"].get("value")

    async def until(self, condition: str) -> Any:
        """Wait for an expression to become true; its value."""
        try:
            return await self.run(UNTIL % condition)
        except TimeoutError:
            shown = await self.run("document.body.innerText")
            raise AssertionError(f"never came: {condition}; the page shows: {shown}") from None

    async def text(self, words: str) -> None:
        """Wait until the page shows these words."""
        await self.until(f"document.body.innerText.includes({json.dumps(words)})")

    async def open(self, url: str) -> None:
        """Go to an address and wait for its scripts."""
        loaded = self.send("Page.navigate", url=url)
        assert "errorText" not in await loaded
        await self.until("document.readyState === 'complete'")

    async def size(self, width: int, height: int, touch: bool = False) -> None:
        """Have a window, or a tablet, of this size."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
        await self.send("Emulation.setDeviceMetricsOverride", **metrics)
        await self.send("Emulation.setTouchEmulationEnabled", enabled=touch)

    async def click(self, selector: str, words: str = "", touch: bool = False) -> None:
        """Click, or tap, the middle of the first element that fits and holds the words."""
        find = FIND % (json.dumps(selector), json.dumps(words))
        x, y = await self.until(find)
        if touch:
            await self.send(
                "Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}]
            )
            await self.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
            return
        for kind in ("mousePressed", "mouseReleased"):
            await self.send(
                "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1
            )

    async def key(self, name: str) -> None:
        """Press a key: a name of KEYS or a digit."""
        code, number, text = KEYS.get(name, (f"Digit{name}", 48, name))
        number = number if name in KEYS else ord(name)
        key = " " if name == "Space" else name
        common = {"key": key, "code": code, "windowsVirtualKeyCode": number}
        await self.send("Input.dispatchKeyEvent", type="keyDown", text=text, **common)
        await self.send("Input.dispatchKeyEvent", type="keyUp", **common)

    async def type(self, text: str) -> None:
        """Type into the field in focus."""
        await self.send("Input.insertText", text=text)

    async def picture(self, path: Path) -> None:
        """Save what is to be seen as PNG."""
        await self.run("document.fonts.ready.then(() => true)")
        shot = await self.send("Page.captureScreenshot", format="png")
        path.write_bytes(base64.b64decode(shot["data"]))


@asynccontextmanager
async def tab(devtools: str, width: int = 1280, height: int = 800) -> AsyncIterator[Tab]:
    """A page of its own, with cookies of its own."""
    socket = await websocket_connect(devtools, max_message_size=LARGEST_ANSWER)
    context = await _ask(socket, 1, "Target.createBrowserContext")
    where = {"url": "about:blank", **context}
    target = await _ask(socket, 2, "Target.createTarget", **where)
    session = await _ask(socket, 3, "Target.attachToTarget", flatten=True, **target)
    page = Tab(socket, session["sessionId"])
    listening = asyncio.ensure_future(page.listen())
    try:
        for domain in ("Page", "Runtime", "Log"):
            await page.send(f"{domain}.enable")
        await page.size(width, height)
        yield page
    finally:
        listening.cancel()
        socket.close()


async def _ask(socket: WebSocketClientConnection, number: int, method: str, **params: Any) -> Any:
    await socket.write_message(json.dumps({"id": number, "method": method, "params": params}))
    while True:
        message = json.loads(await socket.read_message())
        if message.get("id") == number:
            return message["result"]
