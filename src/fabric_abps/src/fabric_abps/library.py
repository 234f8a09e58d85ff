# SPDX-License-Identifier: BSD-3-Clause
"""The policy library Pi (5.2.2.1): named decision models, listed in a YAML index.

The library of a scenario is a folder: library.yaml lists the policies; beside it lie their models,
observation maps, solved policies and cards, and what was trained on them.
"""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

import fabric_planner as fp

INDEX = "library.yaml"  # of a folder
MODELS = "models.npz"  # what was trained on the library, in its folder


class LibraryError(ValueError):
    """The index or a file it names cannot be used; the message names file and element."""


@dataclass(frozen=True)
class Policy:
    """One entry of the library."""

    name: str
    path: Path  # of the .pomdpx file
    about: str  # a sentence for people
    solved: Path | None = None  # alpha vectors of the model, .policy
    card: Path | None = None  # what it is and did, .md

    def vectors(self) -> fp.AlphaVectors | None:
        """The policy as it was solved, None when it was not.

        Raises ModelError naming the file that is broken or does not fit the model.
        """
        return None if self.solved is None else fp.load_policy(self.solved, fp.load(self.path))


@dataclass(frozen=True)
class Library:
    """The candidates for one scenario, in the order of the index."""

    scenario: str
    policies: tuple[Policy, ...]
    base: str  # a new person starts with this one
    index: Path | None = None  # the file it was read from

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
        """SHA-256 over names, model files, their observation maps and solved policies, in order."""
        digest = hashlib.sha256()
        for policy in self.policies:
            digest.update(policy.name.encode() + b"\0")
            parts = [policy.path, policy.path.with_suffix(".obs.yaml")]
            for path in parts + ([policy.solved] if policy.solved else []):
                content = path.read_bytes() if path.exists() else b""
                digest.update(len(content).to_bytes(8, "little") + content)
        return digest.hexdigest()

    @classmethod
    def load(cls, folder_or_index: "str | Path", scenario: str) -> "Library":
        """Read the part of an index for a scenario; paths in it are relative to the index.

        A folder stands for the library.yaml in it. Raises LibraryError naming index and entry when
        the index, an entry or a file it names is missing or malformed.
        """
        index = Path(folder_or_index)
        index = index / INDEX if index.is_dir() else index
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
        return cls(scenario, policies, base, index)


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
        _text(place, key, entry.get(key))
    unknown = sorted(set(entry) - {"name", "model", "about", "solved", "card"})
    if unknown:
        raise LibraryError(f"{place}: unknown key '{unknown[0]}'")
    files = {
        key: _file(index, place, key, entry[key])
        for key in ("model", "solved", "card")
        if key in entry
    }
    policy = Policy(
        entry["name"], files["model"], entry["about"], files.get("solved"), files.get("card")
    )
    _check_files(place, policy)
    return policy


def _text(place: str, key: str, value: Any) -> None:
    if not isinstance(value, str) or not value:
        raise LibraryError(f"{place}/{key}: must be text, got {value!r}")


def _file(index: Path, place: str, key: str, name: Any) -> Path:
    _text(place, key, name)
    path = (index.parent / name).resolve()
    if not path.is_file():
        raise LibraryError(f"{place}/{key}: there is no file {path}")
    return path


def _check_files(place: str, policy: Policy) -> None:
    """Refuse alpha vectors that do not fit their model, and cards that are no text."""
    try:
        policy.vectors()
    except fp.ModelError as error:
        raise LibraryError(f"{place}/solved: {error}") from error
    if policy.card is not None:
        try:
            said = policy.card.read_text(encoding="utf-8").strip()
        except UnicodeDecodeError as error:
            raise LibraryError(f"{place}/card: {policy.card} is no text: {error}") from error
        if not said:
            raise LibraryError(f"{place}/card: {policy.card} is empty")


def write_index(path: Path, scenario: str, base: str, entries: Sequence[dict[str, str]]) -> None:
    """Write an index; entries are dictionaries as in the file, base one of their names.

    A reader sees the old file or the new one, never half of it.
    """
    document = {scenario: {"base": base, "policies": list(entries)}}
    content = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=120)
    partial = path.with_name(path.name + ".part")
    partial.write_text(
        "# SPDX-License-Identifier: BSD-3-Clause\n# Written by ./fabric train.\n" + content,
        encoding="utf-8",
    )
    os.replace(partial, path)
