# SPDX-License-Identifier: BSD-3-Clause
"""run.json: what was run, with which versions, and how it ended."""

import importlib.metadata
import json
import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

FILE_NAME = "run.json"
STATUSES = ("running", "finished", "interrupted", "failed")
SHUT_DOWN = "shut down"  # reason of a task that ended because its node was told to
PACKAGES = ("numpy", "scipy", "PyYAML", "matplotlib")


def versions() -> dict[str, str]:
    """Return the versions of everything that can change a result."""
    found = {"python": platform.python_version(), "commit": _commit()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "unknown"
    return found


def _commit() -> str:
    """Return the commit of the source tree, with a + when files differ from it."""
    command = ["git", "-C", str(Path(__file__).resolve().parent), "describe", "--always"]
    try:
        done = subprocess.run(
            [*command, "--dirty=+"], capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()


class RunRecord:
    """The run.json of one run folder; the file is whole at every moment."""

    def __init__(self, folder: Path, parameters: dict[str, Any]) -> None:
        """Write the file with status `running`. Raises FileExistsError when there is one."""
        self._path = folder / FILE_NAME
        if self._path.exists():
            raise FileExistsError(f"{self._path} belongs to another run")
        folder.mkdir(parents=True, exist_ok=True)
        self._content: dict[str, Any] = {
            "status": "running",
            "reason": "",
            "started": _now(),
            "ended": None,
            "parameters": parameters,
            "versions": versions(),
            "models": {},
            "tasks_done": 0,
        }
        self._write()

    def model(self, name: str, model_hash: str) -> None:
        """Note a model that was in force, by its hash."""
        if self._content["models"].get(name) != model_hash:
            self._content["models"][name] = model_hash
            self._write()

    def task_done(self) -> None:
        """Count a task whose row is written."""
        self._content["tasks_done"] += 1
        self._write()

    def end(self, status: str, reason: str = "") -> None:
        """Note how the run ended. Raises ValueError for an unknown status."""
        if status not in STATUSES:
            raise ValueError(f"status {status!r}; allowed are {', '.join(STATUSES)}")
        self._content.update(status=status, reason=reason, ended=_now())
        self._write()

    def _write(self) -> None:
        text = json.dumps(self._content, indent=2, sort_keys=True, allow_nan=False) + "\n"
        scratch = self._path.with_suffix(".tmp")
        scratch.write_text(text, encoding="utf-8")
        os.replace(scratch, self._path)


def read_run(folder: Path) -> dict[str, Any]:
    """Return the run.json of a folder, empty when there is none.

    Raises ValueError naming a file that is no JSON object.
    """
    path = folder / FILE_NAME
    if not path.exists():
        return {}
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: {error}") from error
    if not isinstance(content, dict):
        raise ValueError(f"{path}: must hold an object, not {content!r}")
    return content


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
