# SPDX-License-Identifier: BSD-3-Clause
"""Writes a built-in worker as POMDPX, to start one's own from.

python -m fabric_sim.worker_export expert_tired_attentive_collaborative mine.pomdpx
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from .character import Character
from .worker_file import to_pomdp
from .worker_model import ModelLibrary
from .worker_parameters import WorkerParameters


def export(human: str, path: Path) -> None:
    """Write the MDP of a type or "e,s,a,c". Raises ValueError for an unknown type."""
    import fabric_planner  # noqa: PLC0415  # late, as in worker_model

    parameters = WorkerParameters.load()
    model = ModelLibrary(parameters.model).build(Character.parse(human))
    fabric_planner.save_pomdpx(to_pomdp(model, parameters.model.discount, path.stem), path)


def main(words: Sequence[str]) -> int:
    """Run the command; exit 2 when a word is refused."""
    if len(words) != 2:
        print("usage: python -m fabric_sim.worker_export TYPE FILE.pomdpx", file=sys.stderr)
        return 2
    try:
        export(words[0], Path(words[1]))
    except (OSError, ValueError) as error:
        print(f"worker_export: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
