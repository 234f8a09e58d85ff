# SPDX-License-Identifier: BSD-3-Clause
"""`python3 -m fabric_study.web.places WORD DIR`: what study.launch asks beforehand.

folder: DIR from the root on, for nodes that run elsewhere
run:    the next run folder, DIR/runs/K, so that all nodes write into the same one
people: DIR/people, where ABPS keeps what it knows of persons
person: the code of whoever is in the middle of a visit, empty when nobody is
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from fabric_study.store import STORE_FILE, StoreError, read_records
from fabric_study.study_folder import next_run
from fabric_study.visit import open_person


def _person(folder: Path) -> str:
    return open_person(read_records(folder)) if (folder / STORE_FILE).exists() else ""


QUESTIONS: Mapping[str, Callable[[Path], object]] = {
    "folder": lambda folder: folder,
    "run": next_run,
    "people": lambda folder: folder / "people",
    "person": _person,
}


def main(arguments: Sequence[str]) -> int:
    """Print the answer without a line end, paths from the root on; exit code 2 for nonsense."""
    if len(arguments) != 2 or arguments[0] not in QUESTIONS or not arguments[1]:
        print(f"usage: places {'|'.join(QUESTIONS)} DIR", file=sys.stderr)
        return 2
    folder = Path(arguments[1]).expanduser().resolve()
    try:
        if folder.exists() and not folder.is_dir():
            raise StoreError(f"{folder}: is no folder")
        print(QUESTIONS[arguments[0]](folder), end="")
    except StoreError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
