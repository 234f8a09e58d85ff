# SPDX-License-Identifier: BSD-3-Clause
"""The pseudo-terminal that stands for the arm's USB port, under a link that keeps its name."""

import os
import pty
import tty
from pathlib import Path


class Terminal:
    """A raw pseudo-terminal. Pulling the plug closes it; plugging in opens another one."""

    def __init__(self, link: Path | None) -> None:
        """Raises FileExistsError when something that is no symbolic link is in the way."""
        if link is not None and link.exists() and not link.is_symlink():
            raise FileExistsError(f"{link} exists and is no symbolic link")
        self._link = link
        self._ends: tuple[int, int] | None = None
        self.path = ""

    @property
    def plugged(self) -> bool:
        """True while a client can open it."""
        return self._ends is not None

    def fileno(self) -> int:
        """Descriptor of the arm's end."""
        return self._ends[0]

    def plug(self) -> None:
        """Opens it; `path` is its device."""
        # Our hold on the client's end keeps the arm's end readable while no client has it open.
        self._ends = pty.openpty()
        for end in self._ends:
            tty.setraw(end)
        os.set_blocking(self._ends[0], False)
        self.path = os.ttyname(self._ends[1])
        if self._link is not None:
            fresh = self._link.with_name(f".{self._link.name}.{os.getpid()}")
            fresh.symlink_to(self.path)
            fresh.replace(self._link)

    def unplug(self) -> None:
        """Closes it; every client that has it open is hung up."""
        if self._ends is None:
            return
        if self._link is not None and self._link.is_symlink():
            if os.readlink(self._link) == self.path:
                self._link.unlink()
        for end in self._ends:
            os.close(end)
        self._ends = None

    def read(self) -> bytes:
        """What has come in."""
        try:
            return os.read(self.fileno(), 4096)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Sends; what a client does not fetch in time is lost, as on a serial line."""
        try:
            os.write(self.fileno(), data)
        except BlockingIOError:
            return
