# SPDX-License-Identifier: BSD-3-Clause
"""`./fabric study verify DIR` and `./fabric study export DIR [FOLDER]`.

Exit codes: 0 done, 1 the study has faults, 2 the command cannot be meant.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

USAGE = """usage: ./fabric study verify DIR
       ./fabric study export DIR [FOLDER]

verify   proves that nothing of a study is missing or changed: numbers, digests, order of steps,
         rows, events, closed bags, the hash of the protocol; names the place of each fault
export   writes people, tasks, answers (long and wide), notes and the code book as CSV files,
         into DIR/export unless another FOLDER is named
"""


def main(arguments: Sequence[str]) -> int:
    """Run the command; return its exit code."""
    words = list(arguments)
    if not words or words[0] in ("-h", "--help"):
        print(USAGE, end="", file=sys.stdout if words else sys.stderr)
        return 0 if words else 2
    name, *folders = words
    most = {"verify": 1, "export": 2}
    if name not in most:
        return _refuse(f"study knows verify and export here, not {name!r}")
    if not 1 <= len(folders) <= most[name] or "" in folders:
        return _refuse(f"study {name} wants the folder of a study, not {' '.join(folders)!r}")
    folder = Path(folders[0])
    if not folder.is_dir():
        return _refuse(f"{folder}: there is no such folder")
    if name == "verify":
        return _verify(folder)
    return _export(folder, Path(folders[1]) if len(folders) > 1 else folder / "export")


def _refuse(text: str) -> int:
    print(f"fabric: {text}", file=sys.stderr)
    return 2


def _verify(folder: Path) -> int:
    from fabric_study.store_verify import verify  # here, so that --help needs nothing

    verdict = verify(folder)
    for line in verdict.checked:
        print(f"checked  {line}")
    for fault in verdict.faults:
        print(f"FAULT    {fault}")
    count = len(verdict.faults)
    found = "nothing is missing" if not count else f"{count} fault{'s' * (count > 1)}"
    print(f"{folder}: {found}")
    return 1 if count else 0


def _export(folder: Path, out: Path) -> int:
    from fabric_study.study_export import export

    try:
        paths = export(folder, out)
    except FileExistsError as error:
        return _refuse(str(error))
    except ValueError as error:
        print(f"fabric: {error}", file=sys.stderr)
        return 1
    for path in paths:
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
