# SPDX-License-Identifier: BSD-3-Clause
"""Where the files of `config/` are, in the source tree or installed."""

from pathlib import Path

from fabric_study.strict_yaml import DefinitionError


def config_folder(kind: str) -> Path:
    """Return the folder `config/<kind>`. Raises DefinitionError naming where it was sought."""
    here = Path(__file__).resolve()
    candidates = [here.parents[2] / "config" / kind]
    if len(here.parents) > 4:
        candidates.append(here.parents[4] / "share" / "fabric_study" / "config" / kind)
    for candidate in candidates:
        if candidate.is_dir():
            return candidate
    raise DefinitionError(f"no {kind} in {' or '.join(map(str, candidates))}")


def names_in(kind: str) -> list[str]:
    """Return the names of the shipped files of a kind, sorted."""
    return sorted(path.stem for path in config_folder(kind).glob("*.yaml"))


def load_path(kind: str, name_or_path: str) -> Path:
    """Return the file that a shipped name or the path of a .yaml file means.

    Raises DefinitionError naming the shipped ones.
    """
    if name_or_path.endswith(".yaml"):
        return Path(name_or_path)
    if name_or_path not in names_in(kind):
        raise DefinitionError(
            f"no {name_or_path!r} among the {kind}; "
            f"there are {', '.join(names_in(kind))}, or give a .yaml file"
        )
    return config_folder(kind) / f"{name_or_path}.yaml"
