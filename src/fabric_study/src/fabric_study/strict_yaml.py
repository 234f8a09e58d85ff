# SPDX-License-Identifier: BSD-3-Clause
"""YAML read strictly: nothing is overwritten or guessed, every complaint names its place."""

import math
from pathlib import Path
from typing import Any

import yaml


class DefinitionError(ValueError):
    """A file says something that cannot be meant; the text names file, key and value."""


class _Loader(yaml.SafeLoader):
    """SafeLoader that refuses a key given twice."""


def _mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: set[Any] = set()
    for key_node, _ in node.value:
        key = loader.construct_object(key_node, deep=True)
        if key in seen:
            line = key_node.start_mark.line + 1
            raise yaml.YAMLError(f"key {key!r} is given twice, in line {line}")
        seen.add(key)
    return loader.construct_mapping(node, deep=True)


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)


def read(path: Path) -> "Section":
    """Return the mapping in a YAML file. Raises DefinitionError naming the file."""
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except (OSError, UnicodeDecodeError) as error:
        raise DefinitionError(f"{path}: cannot be read: {error}") from error
    except (yaml.YAMLError, TypeError) as error:
        raise DefinitionError(f"{path}: {error}") from error
    return Section(str(path), "", content)


class Section:
    """One mapping of a file, with readers that check type and range.

    Every reader raises DefinitionError naming file, key and value.
    """

    def __init__(self, source: str, name: str, content: Any) -> None:
        self._source = source
        self._name = name
        if not isinstance(content, dict):
            raise self.error("", f"must be a mapping, not {content!r}")
        self._content = content
        self._read: set[Any] = set()

    @property
    def content(self) -> dict[Any, Any]:
        """The mapping as it was read, unchecked."""
        return dict(self._content)

    def error(self, key: Any, text: str) -> DefinitionError:
        """Return the complaint `text` about `key` of this mapping, ready to be raised."""
        place = ".".join(str(part) for part in (self._name, key) if part != "")
        return DefinitionError(": ".join(part for part in (self._source, place, text) if part))

    def value(self, key: Any, *default: Any) -> Any:
        """Return the raw value of `key`, or the default when one is given."""
        self._read.add(key)
        if key in self._content:
            return self._content[key]
        if default:
            return default[0]
        raise self.error(key, "is missing")

    def section(self, key: Any) -> "Section":
        """Return the mapping under `key`."""
        name = ".".join(str(part) for part in (self._name, key) if part != "")
        return Section(self._source, name, self.value(key))

    def parts(self, key: str) -> list["Section"]:
        """Return the mappings in the list under `key`; complaints count them from 1."""
        value = self.value(key)
        if not isinstance(value, list):
            raise self.error(key, f"must be a list, not {value!r}")
        name = ".".join(filter(None, (self._name, key)))
        return [Section(self._source, f"{name}.{n}", entry) for n, entry in enumerate(value, 1)]

    def items(self) -> list[tuple[Any, Any]]:
        """Return all pairs; every key then counts as known."""
        self._read.update(self._content)
        return list(self._content.items())

    def number(self, key: str, low: float, high: float, *default: float) -> float:
        """Return a finite number in low..high."""
        value = self.value(key, *default)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(key, f"must be a number, not {value!r}")
        if not math.isfinite(value):
            raise self.error(key, f"is {value}; it must be finite")
        if not low <= value <= high:
            raise self.error(key, f"is {value}; it must lie in {low:g}..{high:g}")
        return float(value)

    def integer(self, key: str, low: int, high: int, *default: int) -> int:
        """Return a whole number in low..high."""
        value = self.value(key, *default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(key, f"must be a whole number, not {value!r}")
        if not low <= value <= high:
            raise self.error(key, f"is {value}; it must lie in {low}..{high}")
        return value

    def choice(self, key: str, allowed: tuple[str, ...]) -> str:
        """Return one of the allowed words."""
        value = self.value(key)
        if value not in allowed:
            raise self.error(key, f"is {value!r}; allowed are {', '.join(allowed)}")
        return str(value)

    def finish(self) -> None:
        """Refuse keys that nobody has asked for."""
        for key in self._content:
            if key not in self._read:
                raise self.error(key, f"is not known; known are {', '.join(sorted(self._read))}")
