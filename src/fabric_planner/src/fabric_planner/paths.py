# SPDX-License-Identifier: BSD-3-Clause
"""Where the models of this package lie, in the source tree or installed."""

from pathlib import Path


def models_folder() -> Path:
    """The folder of the shipped *.pomdpx files. Raises FileNotFoundError when there is none."""
    here = Path(__file__).resolve()
    candidates = [here.parents[2] / "models"]
    candidates += [parent / "share" / "fabric_planner" / "models" for parent in here.parents]
    for folder in candidates:
        if any(folder.glob("*.pomdpx")):
            return folder
    raise FileNotFoundError(f"no models/*.pomdpx beside {here}")


def shipped_models() -> list[Path]:
    """The shipped model files in the order of their names."""
    return sorted(models_folder().glob("*.pomdpx"))
