# SPDX-License-Identifier: BSD-3-Clause
"""The doctor names what is wrong and its cure."""

from __future__ import annotations

import os
import socket

import pytest

from fabric_bringup import doctor, ports


@pytest.fixture
def workspace(tmp_path):
    """A tree that looks built and healthy."""
    (tmp_path / "apt-packages.txt").write_text("# comment\nbash coreutils # more\n")
    for folder in ("src", "launch", "tests", "build", "devel"):
        (tmp_path / folder).mkdir()
    (tmp_path / "CMakeLists.txt").touch()
    (tmp_path / "devel/setup.bash").touch()
    (tmp_path / "build/.fabric_built_all").touch()
    return tmp_path


def test_a_missing_package_is_named(workspace):
    assert list(doctor.check_packages(workspace)) == []
    (workspace / "apt-packages.txt").write_text("bash no-such-package-here\n")
    [(wrong, cure)] = doctor.check_packages(workspace)
    assert "no-such-package-here" in wrong
    assert "bash" not in wrong
    assert cure == "./fabric setup"


def test_a_stale_build_is_named_with_the_newer_file(workspace):
    assert list(doctor.check_build(workspace)) == []
    newer = workspace / "src/new.cpp"
    newer.touch()
    later = (workspace / "build/.fabric_built_all").stat().st_mtime + 10
    os.utime(newer, (later, later))
    [(wrong, _)] = doctor.check_build(workspace)
    assert "src/new.cpp" in wrong


def test_a_workspace_without_build_or_environment_is_told(workspace):
    (workspace / "build/.fabric_built_all").unlink()
    assert "not built" in next(doctor.check_build(workspace))[0]
    assert "no Python environment" in next(doctor.check_environment(workspace))[0]


def test_a_busy_master_port_is_told_and_another_one_chosen(monkeypatch):
    with socket.socket() as busy:
        busy.bind(("", 0))
        busy.listen()
        monkeypatch.setattr(ports, "USUAL", busy.getsockname()[1])
        assert "is busy" in next(doctor.check_master(None))[0]
        with ports.claimed() as port:
            assert port != ports.USUAL
            assert ports.is_free(port)


def test_graphs_side_by_side_do_not_all_want_the_usual_port(monkeypatch):
    with socket.socket() as held:
        held.bind(("", 0))
        monkeypatch.setattr(ports, "USUAL", held.getsockname()[1])
    with ports.claimed() as port:
        assert port == ports.USUAL
    assert ports.any_free() != ports.USUAL
    assert ports.is_free(ports.any_free())


def test_graphs_that_start_at_once_get_ports_of_their_own(monkeypatch):
    monkeypatch.setattr(ports, "USUAL", ports.any_free())
    with ports.claimed() as first, ports.claimed() as second:
        assert first == ports.USUAL != second
        found = iter([first, second, ports.any_free()])
        monkeypatch.setattr(ports, "any_free", lambda: next(found))
        with ports.claimed() as third:
            assert third not in (first, second)
    with ports.claimed() as again:
        assert again == first


def test_a_python_that_does_not_see_ros_is_told(monkeypatch, tmp_path):
    fake = tmp_path / "python3"
    fake.write_text("#!/bin/sh\nexit 1\n")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    [(wrong, cure)] = doctor.check_path(tmp_path)
    assert str(fake) in wrong
    assert "./fabric shell" in cure
