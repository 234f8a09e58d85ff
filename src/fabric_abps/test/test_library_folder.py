# SPDX-License-Identifier: BSD-3-Clause
"""A library as a folder: solved policies and cards are read, and refused by name when broken."""

from pathlib import Path
from shutil import copyfile

import numpy as np
import pytest

import fabric_planner as fp
from fabric_abps import Library, LibraryError
from fabric_abps.library import write_index

MODELS = Path(__file__).parents[2] / "fabric_planner" / "models"
ENTRY = {"name": "rules", "model": "rules.pomdpx", "about": "It takes over by rules."}
FILES = {"solved": "rules.policy", "card": "rules.md"}


@pytest.fixture
def folder(tmp_path) -> Path:
    """A library of one policy, solved, with a card."""
    copyfile(MODELS / "inspection_reactive.pomdpx", tmp_path / "rules.pomdpx")
    copyfile(MODELS / "inspection_reactive.obs.yaml", tmp_path / "rules.obs.yaml")
    model = fp.load(tmp_path / "rules.pomdpx")
    fp.save_policy(fp.solve(model).lower, model, tmp_path / "rules.policy")
    (tmp_path / "rules.md").write_text("# rules\n")
    write_index(tmp_path / "library.yaml", "inspection", "rules", [{**ENTRY, **FILES}])
    return tmp_path


def test_a_folder_stands_for_the_index_in_it(folder) -> None:
    library = Library.load(folder, "inspection")
    assert library == Library.load(folder / "library.yaml", "inspection")
    assert library.index == folder / "library.yaml"
    assert library["rules"].card == (folder / "rules.md").resolve()


def test_the_solved_policy_comes_as_it_was_saved(folder) -> None:
    policy = Library.load(folder, "inspection")["rules"]
    expected = fp.solve(fp.load(policy.path)).lower
    assert np.array_equal(policy.vectors().vectors, expected.vectors)
    assert policy.vectors().actions == expected.actions


def test_a_policy_need_not_be_solved(folder) -> None:
    write_index(folder / "library.yaml", "inspection", "rules", [ENTRY])
    policy = Library.load(folder, "inspection")["rules"]
    assert (policy.solved, policy.card, policy.vectors()) == (None, None, None)


def test_the_hash_follows_the_solved_policy_but_not_the_card(folder) -> None:
    before = Library.load(folder, "inspection").hash
    (folder / "rules.md").write_text("# other words\n")
    assert Library.load(folder, "inspection").hash == before
    path = folder / "rules.policy"
    path.write_text(path.read_text() + "<!-- changed -->\n")
    assert Library.load(folder, "inspection").hash != before


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("rules.policy", b"", r"policies\[0\]/solved: .*rules.policy"),
        ("rules.policy", b"no xml", r"policies\[0\]/solved: .*rules.policy"),
        ("rules.md", b" \n", r"policies\[0\]/card: .*rules.md is empty"),
        ("rules.md", b"\xff\xfe\x00", r"policies\[0\]/card: .*rules.md is no text"),
        ("rules.pomdpx", b"<broken", r"policies\[0\]/solved: .*rules.pomdpx"),
    ],
)
def test_a_broken_file_is_refused_by_entry_and_name(folder, name, content, message) -> None:
    (folder / name).write_bytes(content)
    with pytest.raises(LibraryError, match=f"library.yaml: inspection/{message}"):
        Library.load(folder, "inspection")


@pytest.mark.parametrize("key", ["solved", "card"])
def test_a_missing_file_and_a_name_that_is_no_text_are_refused(folder, key) -> None:
    for value, message in (("gone", f"/{key}: there is no file .*gone"), (3, f"/{key}: must be")):
        write_index(folder / "library.yaml", "inspection", "rules", [{**ENTRY, key: value}])
        with pytest.raises(LibraryError, match=message):
            Library.load(folder, "inspection")


def test_vectors_of_another_model_are_refused(folder) -> None:
    other = fp.load(MODELS / "inspection_proactive.pomdpx")
    one = fp.AlphaVectors(np.zeros((1, other.n_states)), [0])
    fp.save_policy(one, other, folder / "rules.policy")
    with pytest.raises(LibraryError, match="rules.policy"):
        Library.load(folder, "inspection")


def test_a_folder_without_an_index_is_refused(tmp_path) -> None:
    with pytest.raises(LibraryError, match="library.yaml: cannot be read"):
        Library.load(tmp_path, "inspection")
