# SPDX-License-Identifier: BSD-3-Clause
"""The policy library Pi (5.2.2.1): named decision models, listed in a YAML index."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml


class LibraryError(ValueError):
    """The index or a file it names cannot be used; the message names file and element."""


@dataclass(frozen=True)
class Policy:
    """One entry of the library."""

    name: str
    path: Path  # of the .pomdpx file
    about: str  # a sentence for people


@dataclass(frozen=True)
class Library:
    """The candidates for one scenario, in the order of the index."""

    scenario: str
    policies: tuple[Policy, ...]
    base: str  # a new person starts with this one

    @property
    def names(self) -> list[str]:
        """Names of the policies, (n_policies,)."""
        return [policy.name for policy in self.policies]

    def __getitem__(self, name: str) -> Policy:
        """The policy of that name; raises LibraryError naming the ones there are."""
        for policy in self.policies:
            if policy.name == name:
                return policy
        raise LibraryError(f"no policy '{name}' in the library; it has {', '.join(self.names)}")

    @property
    def hash(self) -> str:
        """SHA-256 over names, model files and their observation maps, in order."""
        digest = hashlib.sha256()
        for policy in self.policies:
            digest.update(policy.name.encode() + b"\0")
            for path in (policy.path, policy.path.with_suffix(".obs.yaml")):
                content = path.read_bytes() if path.exists() else b""
                digest.update(len(content).to_bytes(8, "little") + content)
        return digest.hexdigest()

    @classmethod
    def load(cls, index: "str | Path", scenario: str) -> "Library":
        """Read the part of the index for a scenario; paths in it are relative to the index.

        Raises LibraryError when the index, an entry or a model file is missing or malformed.
        """
        index = Path(index)
        section = _section(index, scenario)
        entries = section.get("policies")
        if not isinstance(entries, list) or not entries:
            raise LibraryError(
                f"{index}: {scenario}/policies must be a list with an entry at least"
            )
        policies = tuple(_policy(index, scenario, i, entry) for i, entry in enumerate(entries))
        names = [policy.name for policy in policies]
        for name in names:
            if names.count(name) > 1:
                raise LibraryError(f"{index}: {scenario}/policies: '{name}' is listed twice")
        base = section.get("base")
        if base not in names:
            raise LibraryError(f"{index}: {scenario}/base: '{base}' is none of {', '.join(names)}")
        return cls(scenario, policies, base)


def _section(index: Path, scenario: str) -> dict:
    try:
        document = yaml.safe_load(index.read_text(encoding="utf-8"))
    except OSError as error:
        raise LibraryError(f"{index}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise LibraryError(f"{index}: not a YAML file: {error}") from error
    if not isinstance(document, dict) or not document:
        raise LibraryError(f"{index}: must map scenarios to libraries")
    section = document.get(scenario)
    if not isinstance(section, dict):
        known = ", ".join(str(name) for name in document)
        raise LibraryError(f"{index}: no library for scenario '{scenario}'; it has {known}")
    return section


def _policy(index: Path, scenario: str, number: int, entry: Any) -> Policy:
    place = f"{index}: {scenario}/policies[{number}]"
    if not isinstance(entry, dict):
        raise LibraryError(f"{place}: must have name, model and about, got {entry!r}")
    for key in ("name", "model", "about"):
        if not isinstance(entry.get(key), str) or not entry[key]:
            raise LibraryError(f"{place}/{key}: must be text, got {entry.get(key)!r}")
    unknown = sorted(set(entry) - {"name", "model", "about"})
    if unknown:
        raise LibraryError(f"{place}: unknown key '{unknown[0]}'")
    path = (index.parent / entry["model"]).resolve()
    if not path.is_file():
        raise LibraryError(f"{place}/model: there is no file {path}")
    return Policy(entry["name"], path, entry["about"])
