# SPDX-License-Identifier: BSD-3-Clause
"""What is known of a person, kept in a file under their code (such as P07), never their name."""

import hashlib
import json
import os
import re
from pathlib import Path

from fabric_abps.selector import Selector

FORMAT = 1
CODE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")


class MemoryFileError(ValueError):
    """The file of a person cannot be used; the message names file and entry."""


def fingerprint(models: Path) -> str:
    """SHA-256 of a file of trained models. Raises OSError when it cannot be read."""
    return hashlib.sha256(models.read_bytes()).hexdigest()


class Memory:
    """The file `<folder>/<person>_<scenario>.json` of one person in one scenario."""

    def __init__(self, folder: "str | Path", person: str, scenario: str, models: str) -> None:
        """models: fingerprint of the models that the belief is about. Raises ValueError when the
        code of the person is not letters, digits, - and _, 32 at most."""
        if not CODE.fullmatch(person):
            raise ValueError(
                f"person '{person}' is not a code of 1 to 32 letters, digits, - and _, such as P07"
            )
        self.path = Path(folder) / f"{person}_{scenario}.json"
        self._head = {
            "format": FORMAT,
            "person": person,
            "scenario": scenario,
            "models": models,
        }

    def save(self, selector: Selector) -> None:
        """Write the file; a reader, or who comes after a crash, sees the old one or the new one.

        Raises OSError when it cannot be written.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        partial = self.path.with_name(self.path.name + ".part")
        with partial.open("w", encoding="utf-8") as stream:
            json.dump(self._head | {"state": selector.state()}, stream, allow_nan=False)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(partial, self.path)

    def load(self, selector: Selector) -> bool:
        """Let the selector go on where the file stops; False when there is none yet.

        Raises MemoryFileError when the file is damaged or about other models. It stays as it is
        then, and the selector is as it was, or as after `reset`.
        """
        try:
            text = self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return False
        except (OSError, UnicodeDecodeError) as error:
            raise MemoryFileError(f"{self.path}: cannot be read: {error}") from error
        document = self._checked(text)
        try:
            selector.restore(document["state"])
        except KeyError as error:
            raise MemoryFileError(f"{self.path}: entry {error} is missing") from error
        except (ValueError, TypeError, OverflowError) as error:
            raise MemoryFileError(f"{self.path}: {error}") from error
        return True

    def _checked(self, text: str) -> dict:
        try:
            document = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise MemoryFileError(f"{self.path}: not a JSON file: {error}") from error
        if not isinstance(document, dict):
            raise MemoryFileError(f"{self.path}: must hold an object")
        for key, value in self._head.items():
            if document.get(key) != value:
                hint = " (remove the file, or bring back the models)" if key == "models" else ""
                raise MemoryFileError(
                    f"{self.path}: {key} is {document.get(key)!r}, expected {value!r}{hint}"
                )
        if not isinstance(document.get("state"), dict):
            raise MemoryFileError(f"{self.path}: entry 'state' is missing")
        return document
