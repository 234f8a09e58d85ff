# SPDX-License-Identifier: BSD-3-Clause
"""What a run left behind: prints the paths of the record and gives the exit code.

roslaunch ends with 0 whatever happened, so the run's own record decides.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from fabric_study.run_record import read_run

INTERRUPTED = 130  # as a shell tells of Ctrl-C
SIGNALS = (INTERRUPTED, 143)


def exit_code(run: dict[str, Any], launch_code: int) -> int:
    """0 for a finished run, 130 or 143 for one that somebody ended, 1 for any other."""
    if run.get("status") == "finished":
        return 0
    if launch_code in SIGNALS:
        return launch_code
    return INTERRUPTED if run.get("status") == "interrupted" else 1


def paths(folder: Path) -> list[str]:
    """Where the record lies, and every bag that was not closed."""
    lines = [f"record   {folder}"]
    unclosed = sorted(folder.rglob("*.active"))
    lines += [f"unclosed {path}" for path in unclosed]
    return lines


def main(folder: Path, launch_code: int) -> int:
    """Prints what is there and, unless all went well, why the run ended."""
    try:
        run = read_run(folder)
    except ValueError as error:
        run = {"status": "failed", "reason": str(error)}
    code = exit_code(run, launch_code)
    if code:
        status = run.get("status", "not started")
        reason = run.get("reason") or f"see {folder / 'log'}"
        print(f"fabric: the run is {status}: {reason}", file=sys.stderr)
    print("\n".join(paths(folder)))
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), int(sys.argv[2])))
