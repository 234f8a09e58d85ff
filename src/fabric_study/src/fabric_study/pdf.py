# SPDX-License-Identifier: BSD-3-Clause
"""HTML to PDF by Debian's Chromium, without a screen and without the network."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
TIME_LIMIT = 120.0  # s


def write_pdf(page: Path, pdf: Path) -> str:
    """Write a page as PDF and return "", or the sentence that says why there is none."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        return "no PDF: Chromium is missing (apt install chromium)"
    with tempfile.TemporaryDirectory() as profile:
        part = Path(profile) / "page.pdf"
        command = [
            program,
            "--headless",
            "--disable-gpu",
            "--disable-background-networking",
            f"--user-data-dir={profile}",
            "--no-pdf-header-footer",
            f"--print-to-pdf={part}",
            page.resolve().as_uri(),
        ]
        if os.geteuid() == 0:  # Chromium refuses its sandbox to root
            command.insert(1, "--no-sandbox")
        try:
            told = subprocess.run(command, capture_output=True, timeout=TIME_LIMIT, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            return f"no PDF: {error}"
        if told.returncode or not part.exists():
            last = told.stderr.decode(errors="replace").strip().splitlines()[-1:]
            return f"no PDF: {Path(program).name} ended with {told.returncode} {' '.join(last)}"
        pdf.write_bytes(part.read_bytes())
    return ""
