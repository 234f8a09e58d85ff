# SPDX-License-Identifier: BSD-3-Clause
"""`python3 -m fabric_study.web.next_run DIR` prints the next run folder of a study, DIR/runs/K.

study.launch asks for it before anything starts, so that all nodes write into the same folder.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from fabric_study.study_folder import next_run


def main(arguments: Sequence[str]) -> int:
    """Print the absolute path without a line end; exit code 2 for anything but one folder."""
    if len(arguments) != 1 or not arguments[0]:
        print("next_run wants the folder of a study", file=sys.stderr)
        return 2
    folder = Path(arguments[0]).expanduser().resolve()
    if folder.exists() and not folder.is_dir():
        print(f"{folder}: is no folder", file=sys.stderr)
        return 2
    print(next_run(folder), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
