# SPDX-License-Identifier: BSD-3-Clause
"""Reading of configuration files: what is missing or senseless is refused by file, entry, value."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml


class ConfigError(ValueError):
    """A configuration file is wrong; the message names the file, the entry and its value."""


class Entries:
    """A branch of a YAML file."""

    def __init__(self, tree: Any, path: str, prefix: str = "") -> None:
        """Wrap `tree`, found in file `path` under the dotted name `prefix`."""
        self._path = path
        self._prefix = prefix
        if not isinstance(tree, dict):
            raise ConfigError(f"{path}: {prefix or 'the file'} is {tree!r}, want named entries")
        self._tree = tree

    @classmethod
    def read(cls, path: str | Path) -> "Entries":
        """Read a file. Raises ConfigError when it is not YAML or cannot be read."""
        try:
            tree = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise ConfigError(f"{path}: is not YAML: {error}") from None
        return cls(tree, str(path))

    def names(self) -> list[str]:
        """Names of the entries."""
        return [str(key) for key in self._tree]

    def branch(self, key: str) -> "Entries":
        """The branch under an entry."""
        return Entries(self._get(key), self._path, self._name(key))

    def branches(self, key: str) -> list["Entries"]:
        """The branches of a list."""
        value = self._get(key)
        if not isinstance(value, list) or not value:
            raise self.error(key, "a list with one entry or more")
        name = self._name(key)
        return [Entries(item, self._path, f"{name}[{i}]") for i, item in enumerate(value)]

    def number(self, key: str, low: float = -math.inf, high: float = math.inf) -> float:
        """A finite number in [low, high]."""
        value = self._get(key)
        return self._number(key, value, low, high)

    def positive(self, key: str) -> float:
        """A finite number above zero."""
        value = self.number(key)
        if value <= 0.0:
            raise self.error(key, "a positive number")
        return value

    def whole(self, key: str, low: int) -> int:
        """A whole number, `low` or more."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, int) or value < low:
            raise self.error(key, f"a whole number, {low} or more")
        return value

    def span(self, key: str, low: float, high: float) -> tuple[float, float]:
        """Two numbers in [low, high], the smaller first."""
        a, b = self.numbers(key, 2, low, high)
        if a > b:
            raise self.error(key, "the smaller number first")
        return a, b

    def numbers(
        self, key: str, count: int, low: float = -math.inf, high: float = math.inf
    ) -> tuple[float, ...]:
        """A list of so many finite numbers in [low, high]."""
        value = self._get(key)
        if not isinstance(value, list) or len(value) != count:
            raise self.error(key, f"{count} numbers")
        return tuple(self._number(f"{key}[{i}]", item, low, high) for i, item in enumerate(value))

    def word(self, key: str, allowed: Sequence[str] | None = None) -> str:
        """A word, one of the allowed ones when these are given."""
        value = self._get(key)
        if not isinstance(value, str) or not value:
            raise self.error(key, "a word")
        if allowed is not None and value not in allowed:
            raise self.error(key, f"one of {', '.join(allowed)}")
        return value

    def error(self, key: str, wanted: str) -> ConfigError:
        """The error about an entry that is there but wrong."""
        return ConfigError(
            f"{self._path}: {self._name(key)} is {self._tree.get(key)!r}, want {wanted}"
        )

    def _name(self, key: str) -> str:
        return f"{self._prefix}.{key}" if self._prefix else key

    def _get(self, key: str) -> Any:
        if key not in self._tree:
            raise ConfigError(f"{self._path}: {self._name(key)} is missing")
        return self._tree[key]

    def _number(self, key: str, value: Any, low: float, high: float) -> float:
        where = f"{self._path}: {self._name(key)} is {value!r}"
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ConfigError(f"{where}, want a number")
        if not math.isfinite(value):
            raise ConfigError(f"{where}, want a finite number")
        if not low <= value <= high:
            raise ConfigError(f"{where}, want {_range(low, high)}")
        return float(value)


def _range(low: float, high: float) -> str:
    if math.isinf(high):
        return f"{low:g} or more"
    if math.isinf(low):
        return f"{high:g} or less"
    return f"{low:g} to {high:g}"
