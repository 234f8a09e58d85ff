# SPDX-License-Identifier: BSD-3-Clause
"""What the experiments share at the shell: an argument's type, their folder, what they print."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path
from typing import Any


def positive(text: str) -> int:
    """Return the whole number, 1 or more, that an argument gives; argparse tells what is wrong."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is less than 1")
    return value


def new_folder(name: str) -> Path:
    """Return `runs/<date>_<time>_<name>`, where an experiment writes unless told otherwise."""
    return Path("runs") / f"{datetime.now().strftime('%Y-%m-%d_%H-%M-%S')}_{name}"


def without_nan(content: Any) -> Any:
    """Return nested content as JSON takes it, with None in place of what is not finite."""
    if isinstance(content, dict):
        return {key: without_nan(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [without_nan(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def tell(text: str, lines: Iterable[dict[str, Any]], paths: Iterable[Path], as_json: bool) -> None:
    """Print the tables, or one JSON object a line, and which files were written.

    Whoever reads may stop in the middle, as `head` does: all is written by now.
    """
    try:
        for said in map(json.dumps, lines) if as_json else [text]:
            print(said)
        for path in paths:
            print(f"wrote {path}", file=sys.stderr if as_json else sys.stdout)
        sys.stdout.flush()
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())  # for what Python still flushes at its end
        os.close(nowhere)
