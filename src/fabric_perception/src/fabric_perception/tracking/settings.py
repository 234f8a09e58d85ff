# SPDX-License-Identifier: BSD-3-Clause
"""Reading of the tracker's YAML files: what is missing or senseless is refused by file and name."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml


class SettingsError(ValueError):
    """A file or a value of it cannot be used; the message names file, entry and value."""


class Settings:
    """A branch of a YAML file."""

    def __init__(self, tree: Any, path: str, prefix: str = "") -> None:
        """Wrap `tree`, found in the file `path` under the dotted name `prefix`."""
        self._path, self._prefix = path, prefix
        if not isinstance(tree, Mapping):
            raise SettingsError(f"{path}: {prefix or 'the file'} is {tree!r}, want named entries")
        self._tree = tree

    @classmethod
    def read(cls, path: str | Path) -> "Settings":
        """Read a file. Raises SettingsError when it cannot be read or is not YAML."""
        try:
            tree = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise SettingsError(f"{path}: cannot be read: {error.strerror}") from None
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise SettingsError(f"{path}: is not YAML: {error}") from None
        return cls(tree, str(path))

    def names(self) -> list[str]:
        """Names of the entries."""
        return [str(name) for name in self._tree]

    def branch(self, name: str) -> "Settings":
        """The branch under an entry."""
        return Settings(self._get(name), self._path, self._full(name))

    def branches(self, name: str) -> list["Settings"]:
        """The branches of a list with one entry or more."""
        value = self._get(name)
        if not isinstance(value, list) or not value:
            raise self.error(name, "a list with one entry or more")
        full = self._full(name)
        return [Settings(item, self._path, f"{full}[{i}]") for i, item in enumerate(value)]

    def number(self, name: str, low: float = -math.inf, high: float = math.inf) -> float:
        """A finite number in [low, high]."""
        value = self._get(name)
        if not _is_number(value) or not math.isfinite(value):
            raise self.error(name, "a finite number")
        if not low <= value <= high:
            raise self.error(name, f"a number from {low:g} to {high:g}")
        return float(value)

    def numbers(
        self, name: str, count: int, low: float = -math.inf, high: float = math.inf
    ) -> tuple[float, ...]:
        """A list of `count` finite numbers in [low, high]."""
        value = self._get(name)
        wanted = f"{count} numbers from {low:g} to {high:g}"
        if not isinstance(value, list) or len(value) != count:
            raise self.error(name, wanted)
        if not all(_is_number(v) and math.isfinite(v) and low <= v <= high for v in value):
            raise self.error(name, wanted)
        return tuple(float(v) for v in value)

    def span(self, name: str, high: int) -> tuple[int, int]:
        """Two whole numbers, 0 to `high`."""
        value = self._get(name)
        whole = isinstance(value, list) and len(value) == 2
        if not whole or not all(type(v) is int and 0 <= v <= high for v in value):
            raise self.error(name, f"two whole numbers from 0 to {high}")
        return value[0], value[1]

    def word(self, name: str, allowed: Sequence[str] = ()) -> str:
        """A word, one of the allowed ones when these are given."""
        value = self._get(name)
        if not isinstance(value, str) or not value:
            raise self.error(name, "a word")
        if allowed and value not in allowed:
            raise self.error(name, f"one of {', '.join(allowed)}")
        return value

    def error(self, name: str, wanted: str) -> SettingsError:
        """The error about an entry that is there but wrong."""
        return SettingsError(
            f"{self._path}: {self._full(name)} is {self._tree.get(name)!r}, want {wanted}"
        )

    def _full(self, name: str) -> str:
        return f"{self._prefix}.{name}" if self._prefix else name

    def _get(self, name: str) -> Any:
        if name not in self._tree:
            raise SettingsError(f"{self._path}: {self._full(name)} is missing")
        return self._tree[name]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
