# SPDX-License-Identifier: BSD-3-Clause
"""Three public clients, each in its own environment, carry out every step on the emulator."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

CONFORMANCE = Path(__file__).resolve().parents[1] / "conformance"
sys.path.insert(0, str(CONFORMANCE))
from session import STEPS  # noqa: E402


def run(*words: str | Path) -> subprocess.CompletedProcess:
    command = [sys.executable, CONFORMANCE, *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_every_client_carries_out_every_step(tmp_path):
    told = run("--json", tmp_path / "results.json")
    assert told.returncode == 0, told.stdout + told.stderr
    results = json.loads((tmp_path / "results.json").read_text())
    assert set(results) == {"pydobot", "pydobotlab", "pydobotplus"}
    for entries in results.values():
        assert [entry["step"] for entry in entries] == list(STEPS)


def test_a_client_that_there_is_not_is_refused_by_name():
    told = run("pydobot3")
    assert told.returncode == 2
    assert "'pydobot3'" in told.stderr


@pytest.mark.parametrize("client", ["pydobot", "pydobotlab", "pydobotplus"])
def test_every_client_is_pinned(client):
    lines = (CONFORMANCE / f"requirements-{client}.txt").read_text().splitlines()
    packages = [line for line in lines if not line.startswith("#")]
    assert any(line.startswith(f"{client}==") for line in packages)
    assert all("==" in line for line in packages)
