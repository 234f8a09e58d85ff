# SPDX-License-Identifier: BSD-3-Clause
"""Compiled modules are used when they were made of just these sources, and never otherwise."""

import json
import sysconfig
from pathlib import Path

import pytest

import fabric_msgs
from fabric_msgs import compiled

SOURCE = Path(compiled.__file__).resolve().parent
SUFFIX = sysconfig.get_config_var("EXT_SUFFIX")


def folder(at, **changes):
    """A folder of compiled modules of one source, as the build leaves it."""
    source = at / "source.py"
    source.write_text("x = 1\n")
    manifest = {
        "made_for": {"suffix": SUFFIX},
        "packages": {"fabric_msgs": str(SOURCE)},
        "sources": {str(source): compiled.fingerprint(source)},
    }
    place = at / compiled.FOLDER
    (place / "fabric_msgs").mkdir(parents=True)
    (place / compiled.MANIFEST).write_text(json.dumps(manifest | changes))
    return place


def test_fresh_ones_are_used(tmp_path, monkeypatch):
    monkeypatch.delenv("FABRIC_COMPILED", raising=False)
    place = folder(tmp_path)
    assert compiled._usable(place) == place


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"made_for": {"suffix": ".cpython-27.so"}}, "was made for another Python"),
        ({"packages": {"fabric_msgs": "/elsewhere"}}, "was made of another fabric_msgs"),
        ({"packages": {"fabric_nothing": "/elsewhere"}}, "was made of another fabric_nothing"),
        ({"sources": {"/gone.py": "0"}}, "is older than /gone.py"),
    ],
)
def test_others_are_not_and_a_warning_says_why(tmp_path, monkeypatch, changes, words):
    monkeypatch.delenv("FABRIC_COMPILED", raising=False)
    with pytest.warns(RuntimeWarning, match=words):
        assert compiled._usable(folder(tmp_path, **changes)) is None


def test_an_edited_source_runs_in_place_of_what_was_made_of_it(tmp_path, monkeypatch):
    monkeypatch.delenv("FABRIC_COMPILED", raising=False)
    place = folder(tmp_path)
    (tmp_path / "source.py").write_text("x = 2\n")
    with pytest.warns(RuntimeWarning, match="running slowly from the sources"):
        assert compiled._usable(place) is None


def test_they_can_be_switched_off(tmp_path, monkeypatch):
    monkeypatch.setenv("FABRIC_COMPILED", "0")
    assert compiled._usable(folder(tmp_path)) is None


def test_a_package_without_compiled_modules_is_left_alone():
    path = [str(SOURCE)]
    compiled.use("fabric_nothing", path)
    assert path == [str(SOURCE)]
    assert str(SOURCE) in fabric_msgs.__path__
