# SPDX-License-Identifier: BSD-3-Clause
"""Building a policy library: one seed gives one library, and a build that was stopped goes on."""

import re
from functools import partial
from pathlib import Path

import pytest
from training_helpers import write_library

import fabric_planner as fp
from fabric_abps import candidates
from fabric_sim import batch_library
from fabric_sim.batch_candidates import People, draw
from fabric_sim.batch_files import Files
from fabric_sim.batch_library import Plan, build, first_look

PLAN = Plan(
    "inspection", 101, candidates=3, generations=3, children=1, people=3, first=1, second=1, size=4
)
REWARD = r"\| reward, points \| (-?[\d.]+) \|"  # of a card


class Killed(Exception):
    """The build is stopped from outside."""


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def backwards(function, items):
    """Work spread otherwise: the last job is done first, the order of results is kept."""
    return reversed([function(item) for item in reversed(items)])


@pytest.fixture(scope="module", autouse=True)
def solved_roughly():
    """A hundredth of the work on each model; nothing here depends on how well it is solved."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(candidates, "WORK", candidates.WORK / 100.0)
        yield


@pytest.fixture(scope="module")
def built(solved_roughly, tmp_path_factory):
    folder = tmp_path_factory.mktemp("library") / "inspection"
    told = []
    library = build(PLAN, folder, progress=lambda done, total: told.append((done, total)))
    return library, folder, told


def test_the_library_has_its_size_the_baselines_first_and_a_folder_that_loads(built) -> None:
    library, folder, _ = built
    assert library.names[:2] == ["proactive", "reactive"]
    assert len(set(library.names)) == PLAN.size
    earned = {p.name: float(re.search(REWARD, p.card.read_text())[1]) for p in library.policies}
    assert earned[library.base] == max(earned.values())
    for policy in library.policies:
        assert policy.vectors() is not None
        assert policy.card.read_text().startswith("<!-- SPDX")
        agent = Files().offline_agent(policy.path, policy.vectors())
        assert agent.model.actions == fp.load(policy.path).actions
    assert len(content(folder)) == 4 * PLAN.size + 1


def test_progress_is_told_after_each_look_at_a_candidate(built) -> None:
    assert PLAN.steps == 3 + 3 + 1 + 1 + 8
    assert built[2] == [(done, PLAN.steps) for done in range(1, PLAN.steps + 1)]


def test_the_same_seed_gives_the_same_files_however_the_work_is_spread(built, tmp_path) -> None:
    build(PLAN, tmp_path / "inspection", backwards)
    assert content(tmp_path / "inspection") == content(built[1])


def test_a_build_that_was_killed_goes_on_where_it_was(built, tmp_path, monkeypatch) -> None:
    done = []

    def dies(function, items):
        for item in items:
            if len(done) == 4:
                raise Killed
            done.append(item)
            yield function(item)

    folder = tmp_path / "inspection"
    with pytest.raises(Killed):
        build(PLAN, folder, dies)
    assert not folder.exists()

    def counting(plan, wanted):
        done.append(wanted)
        return first_look(plan, wanted)

    monkeypatch.setattr(batch_library, "first_look", counting)
    told = []
    build(PLAN, folder, progress=lambda now, total: told.append(now))
    assert told[0] == 4
    assert [wanted["name"] for wanted in done] == [*PLAN.names, "child_000", "child_001"]
    assert content(folder) == content(built[1])
    assert [path.name for path in tmp_path.iterdir()] == ["inspection"]


def test_results_of_another_plan_are_not_taken(tmp_path) -> None:
    folder = tmp_path / "inspection"

    def dies(function, items):
        yield function(items[0])
        raise Killed

    with pytest.raises(Killed):
        build(PLAN, folder, dies)
    told = []
    other = Plan(
        "inspection", seed=102, candidates=2, children=0, people=2, first=1, second=1, size=2
    )
    build(other, folder, progress=lambda done, total: told.append(done))
    assert told[0] == 1


def test_an_older_library_is_replaced_at_the_end_and_kept(built, tmp_path, capsys) -> None:
    write_library(tmp_path)
    (tmp_path / "inspection/mine.pomdpx").write_text("an evening of work")
    before = content(tmp_path / "inspection")

    def dies(function, items):
        raise Killed

    with pytest.raises(Killed):
        build(PLAN, tmp_path / "inspection", dies)
    assert content(tmp_path / "inspection") == before
    words = "candidates=3 generations=3 children=1 people=3 first=1 second=1 size=4 jobs=1".split()
    place = str(tmp_path / "inspection")
    assert batch_library.main(["inspection", place, *(f"--{word}" for word in words)]) == 0
    assert content(tmp_path / "inspection") == content(built[1])
    assert content(tmp_path / ".inspection.before") == before
    assert f"{tmp_path}/.inspection.before: what was there" in capsys.readouterr().out


def test_a_folder_that_is_no_library_of_the_scenario_is_refused_before_any_work(
    tmp_path, capsys
) -> None:
    write_library(tmp_path, "sorting")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes/day.md").write_text("a year of work")
    before = sorted(tmp_path.rglob("*"))
    for name in ("notes", "sorting", "notes/day.md"):
        assert batch_library.main(["inspection", str(tmp_path / name)]) == 2
        assert f"{tmp_path / name} is not replaced" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_candidates_differ_and_repeat_with_the_seed() -> None:
    one, other = (draw("inspection", 101, f"candidate_{number:03d}") for number in (0, 1))
    assert one["setting"] != other["setting"]
    assert one["model"] != other["model"]
    assert draw("inspection", 101, "candidate_000") == one
    assert draw("inspection", 102, "candidate_000")["setting"] != one["setting"]


def test_a_child_has_each_dial_near_that_of_a_parent() -> None:
    parents = [draw("inspection", 101, f"candidate_{number:03d}")["setting"] for number in (0, 1)]
    child = draw("inspection", 101, "child_000", parents)
    assert child == draw("inspection", 101, "child_000", parents)
    setting = child["setting"]
    assert setting["observability"] in {parent["observability"] for parent in parents}
    for name, factor in setting["factors"].items():
        assert any(1 / 4 < factor / parent["factors"][name] < 4 for parent in parents)
        assert all(setting["factors"] != parent["factors"] for parent in parents)


def test_a_written_candidate_is_taken_as_it_is() -> None:
    source = Files().model("reactive", "sorting")
    found = draw("sorting", 101, "reactive")
    assert found["setting"] is None
    assert found["model"] == source.read_text()
    assert found["map"] == source.with_suffix(".obs.yaml").read_text()


def test_the_second_look_meets_the_same_people_on_other_seeds() -> None:
    first, again = People(101, 5), People(101, 5, again=True)
    assert first.dials == again.dials
    assert first.run_seed(3) != again.run_seed(3)


def test_both_looks_notice_the_same_things_of_everybody() -> None:
    found = first_look(PLAN, {"name": "none", "parents": []})
    again = partial(batch_library.second_look, PLAN)(found)
    assert [len(found[key]) for key in ("rewards", "notices")] == [3, 3]
    assert all(notices[1:4] == [0.0, 0.0, 0.0] for notices in found["notices"])
    assert again["rewards"] != found["rewards"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"scenario": "cooking"}, "scenario is 'cooking', none of inspection, sorting"),
        ({"people": 0}, "people is 0; it must be a whole number >= 1"),
        ({"size": 1}, "size is 1; it must be a whole number >= 2"),
        (
            {"candidates": 3, "generations": 2, "children": 1, "size": 8},
            "size is 8, there are 7 candidates",
        ),
        ({"first": -1}, "first is -1"),
    ],
)
def test_a_senseless_plan_is_refused_by_name(words, message) -> None:
    with pytest.raises(ValueError, match=message):
        Plan(**{"scenario": "inspection", "seed": 101, **words})
