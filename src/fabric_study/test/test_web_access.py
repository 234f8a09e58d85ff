# SPDX-License-Identifier: BSD-3-Clause
"""Tokens, where they are kept, and which names a request may use."""

import stat

import pytest

from fabric_study.web.access import Keys, Role, host_allowed, is_loopback, kept_keys, new_keys


def test_each_token_gives_its_role_and_nothing_else_does():
    keys = new_keys()
    assert keys.role(keys.participant) == Role.PARTICIPANT
    assert keys.role(keys.experimenter) == Role.EXPERIMENTER
    for other in ("", "guess", keys.participant[:-1], keys.experimenter + "x", "ä"):
        assert keys.role(other) == Role.NOBODY


def test_tokens_stay_the_same_over_a_restart(tmp_path):
    path = tmp_path / "keys" / "study.json"
    first = kept_keys(path)
    assert kept_keys(path) == first
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"participant": "a", "experimenter": "b"}'])
def test_a_file_of_tokens_that_cannot_be_meant_is_replaced(tmp_path, text):
    path = tmp_path / "study.json"
    path.write_text(text)
    path.chmod(0o600)
    keys = kept_keys(path)
    assert len(keys.participant) >= 24
    assert kept_keys(path) == keys


def test_tokens_that_others_could_read_are_not_used(tmp_path):
    path = tmp_path / "study.json"
    first = kept_keys(path)
    path.chmod(0o644)
    assert kept_keys(path) != first


def test_on_loopback_only_names_of_this_machine_are_taken():
    for host in ("localhost:8890", "127.0.0.1", "[::1]:8890"):
        assert host_allowed("127.0.0.1", host)
    for host in ("evil.example", "192.168.1.4:8890", ""):
        assert not host_allowed("127.0.0.1", host)
    assert host_allowed("192.168.1.4", "192.168.1.4:8890")


def test_loopback_is_told_from_other_addresses():
    assert all(map(is_loopback, ("localhost", "127.0.0.1", "127.3.2.1", "::1")))
    assert not any(map(is_loopback, ("0.0.0.0", "192.168.1.4", "::", "", "example.org")))


def test_keys_are_two():
    keys = new_keys()
    assert keys != new_keys() and keys.participant != keys.experimenter
    assert isinstance(keys, Keys)
