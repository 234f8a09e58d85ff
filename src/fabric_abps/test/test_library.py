# SPDX-License-Identifier: BSD-3-Clause
"""The library index: what it gives, what it refuses, what its hash covers."""

from pathlib import Path

import pytest
from conftest import POLICIES

from fabric_abps import Library, LibraryError

ENTRY = "{name: waits, model: waits.pomdpx, about: It waits.}"
SHIPPED = Path(__file__).parent.parent / "library"


def test_policies_come_in_the_order_of_the_index_with_paths_beside_it(library, index) -> None:
    assert library.names == list(POLICIES)
    assert library["helps"].path == index.parent / "helps.pomdpx"
    assert library.base == "waits"


@pytest.mark.parametrize("scenario", ["inspection", "sorting"])
def test_shipped_libraries_load_and_start_with_a_policy_of_theirs(scenario) -> None:
    library = Library.load(SHIPPED / scenario, scenario)
    assert library.base in library.names
    assert {"proactive", "reactive"} <= set(library.names)


def test_hash_follows_the_content_of_models_and_observation_maps(index) -> None:
    hashes = {Library.load(index, "tiny").hash}
    for name, text in (("waits.pomdpx", "other"), ("helps.obs.yaml", "rules: []")):
        (index.parent / name).write_text(text)
        hashes.add(Library.load(index, "tiny").hash)
    assert len(hashes) == 3
    assert Library.load(index, "tiny").hash in hashes


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must map scenarios"),
        ("tiny: [", "not a YAML file"),
        ("other: {base: waits}", "no library for scenario 'tiny'; it has other"),
        ("tiny: {base: waits, policies: []}", "tiny/policies must be a list"),
        (f"tiny: {{base: nobody, policies: [{ENTRY}]}}", "tiny/base: 'nobody' is none of waits"),
        (f"tiny: {{base: waits, policies: [{ENTRY}, {ENTRY}]}}", "'waits' is listed twice"),
        ("tiny: {base: a, policies: [a]}", r"policies\[0\]: must have name"),
        (
            "tiny: {base: a, policies: [{name: a, model: 3, about: x}]}",
            r"\[0\]/model: must be text",
        ),
        ("tiny: {base: a, policies: [{name: a, model: gone.pomdpx, about: x}]}", "gone.pomdpx"),
        ("tiny: {base: a, policies: [{name: a, model: waits.pomdpx, about: x, q: 1}]}", "key 'q'"),
    ],
)
def test_a_bad_index_is_refused_by_element(index, text, message) -> None:
    index.write_text(text)
    with pytest.raises(LibraryError, match=f"library.yaml: .*{message}"):
        Library.load(index, "tiny")


def test_a_missing_index_and_an_unknown_policy_are_refused_by_name(tmp_path, library) -> None:
    with pytest.raises(LibraryError, match="absent.yaml: cannot be read"):
        Library.load(tmp_path / "absent.yaml", "tiny")
    with pytest.raises(LibraryError, match="no policy 'x' in the library; it has waits"):
        library["x"]
