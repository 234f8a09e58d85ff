# SPDX-License-Identifier: BSD-3-Clause
"""The example that the README shows."""

import re
import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).parents[1] / "examples" / "ten_lines.py"


def test_the_ten_line_example_runs_and_agrees_with_itself():
    done = subprocess.run(
        [sys.executable, str(EXAMPLE)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    lower, upper = map(float, lines[0].split()[3::2])
    assert lower <= upper <= 1.1 * lower
    assert len(lines) == 8
    cv, error = map(float, re.search(r"cv (\S+) \+- (\S+)>", lines[-1]).groups())
    assert lower - 5 * error - 1e-3 <= cv <= upper + 5 * error + 1e-3


def test_the_example_has_ten_lines():
    code = EXAMPLE.read_text().split("import models_folder\n")[1]
    assert len([line for line in code.splitlines() if line]) <= 10
