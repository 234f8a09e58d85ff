# SPDX-License-Identifier: BSD-3-Clause
"""Training: people do not depend on each other; a training goes on where it was killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest
from training_helpers import POLICIES, words, write_library

from fabric_abps import Job, Library, LibraryError, TrainedModels
from fabric_sim import batch_library, batch_train, batch_train_folder, batch_train_work
from fabric_sim.batch_loop import Files
from fabric_sim.batch_train import measure, train_models
from fabric_sim.batch_train_folder import check_replaceable, replace_folder
from fabric_sim.batch_train_people import Recipe, Trainer, code_fingerprint, known_types
from fabric_sim.batch_train_work import Work, chunks_of, spread
from fabric_sim.character import CORNERS, Character

PEOPLE = (
    "beginner_tired_distracted_noncollaborative",
    "expert_rested_attentive_collaborative",
    "0.5,0.5,0.2,0.9",
)


@pytest.fixture(autouse=True)
def sources_are_read_anew() -> None:
    """As by the processes that a test starts, should somebody edit while the tests run."""
    code_fingerprint.cache_clear()


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> Library:
    return write_library(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="module")
def recipe(library) -> Recipe:
    return Recipe.of(library)


def test_a_person_is_the_same_whoever_came_before(recipe) -> None:
    jobs = [
        Job(name, person, seed, 3) for name in POLICIES for person in PEOPLE for seed in (101, 102)
    ]
    forth, back = Trainer(recipe), Trainer(recipe)
    results = [forth(job) for job in jobs]
    assert len({utility for session in results for utility, _ in session}) > 3
    assert [back(job) for job in reversed(jobs)] == results[::-1]


def test_a_person_goes_on_from_task_to_task(recipe) -> None:
    """The first tasks of a long session are those of a short one; later ones depend on them."""
    trainer = Trainer(recipe)
    long = trainer(Job("reactive", PEOPLE[0], 101, 6))
    assert trainer(Job("reactive", PEOPLE[0], 101, 2)) == long[:2]


def test_the_files_of_a_policy_may_go_once_they_were_read(tmp_path) -> None:
    library = write_library(tmp_path)
    recipe = Recipe.of(library)
    expected = Trainer(recipe)(Job("reactive", PEOPLE[1], 101, 2))
    for path in (tmp_path / "inspection").iterdir():
        path.unlink()
    assert Trainer(recipe)(Job("reactive", PEOPLE[1], 101, 2)) == expected


def test_other_software_is_refused(recipe) -> None:
    with pytest.raises(RuntimeError, match="another version of FABRIC"):
        Trainer(Recipe(recipe.scenario, recipe.policies, "0" * 64))


def test_sets_of_known_types_lie_within_each_other() -> None:
    sets = [known_types(number) for number in (4, 8, 16, 32)]
    for small, large in zip(sets, sets[1:], strict=False):
        assert set(small) < set(large)
        assert len(large) == len(set(large)) == 2 * len(small)
    assert sets[2] == list(CORNERS)
    for names in sets[:3]:  # every dial is high as often as low
        dials = np.array([Character.parse(name).dials for name in names])
        assert (dials.mean(axis=0) == 0.5).all()
    with pytest.raises(ValueError, match="4, 8, 16 or 32 known types, not 5"):
        known_types(5)


def test_any_characters_and_worker_files_can_be_the_known_types(library) -> None:
    types = (*PEOPLE, str(Files().share("fabric_sim") / "models/example_worker.pomdpx"))
    models = train_models(library, types, tasks=3, seed=101)
    assert models.types == types
    assert (models.performance.count == 3).all()


def test_processes_change_nothing(library, tmp_path) -> None:
    train_models(library, PEOPLE, tasks=9, seed=101, cache=tmp_path / "one.npz")
    train_models(library, PEOPLE, tasks=9, seed=101, map_chunks=spread(2), cache=tmp_path / "two")
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two").read_bytes()


def test_models_are_taken_from_the_cache_only_if_trained_in_this_way(library, tmp_path) -> None:
    cache = tmp_path / "models.npz"
    first = train_models(library, PEOPLE, tasks=3, seed=101, cache=cache)
    written = cache.stat().st_mtime_ns
    train_models(library, PEOPLE, tasks=3, seed=101, cache=cache)
    assert cache.stat().st_mtime_ns == written
    other = train_models(library, PEOPLE, tasks=3, seed=102, cache=cache)
    assert (first.performance.mean != other.performance.mean).any()
    assert TrainedModels.load(cache).seed == 102


def test_what_is_finished_is_not_run_again(recipe, library, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(batch_train_work.CHUNK_TASKS, "inspection", 2)
    jobs = [Job("none", person, 101, 2) for person in PEOPLE]
    asked = []

    def counting(function, chunks):
        for chunk in chunks:
            asked.append(chunk)
            yield function(chunk)

    first = Work(recipe, counting, tmp_path / "work")(None, jobs)
    results = [next(first)]
    first.close()
    again = list(Work(recipe, counting, tmp_path / "work")(None, jobs))
    assert again[:1] == results
    assert asked == [[job] for job in jobs]
    assert again == list(Work(recipe, map)(None, jobs))


def test_a_broken_piece_of_work_is_named(recipe, tmp_path) -> None:
    jobs = [Job("none", PEOPLE[0], 101, 2)]
    for text in ("[[[1.0,", "[[]]", "[[[1.0, [1]]]]", "7"):
        (tmp_path / "00000.json").write_text(text)
        with pytest.raises(ValueError, match="00000.json: broken, remove it"):
            list(Work(recipe, map, tmp_path)(None, jobs))


def test_chunks_are_small_and_hold_every_job_once(library) -> None:
    jobs = batch_train.jobs_of(library, known_types(16), 90, 101)
    for scenario, most in batch_train_work.CHUNK_TASKS.items():
        chunks = chunks_of(jobs, scenario)
        assert [job for chunk in chunks for job in chunk] == jobs
        assert max(sum(job.tasks for job in chunk) for chunk in chunks) <= most


def test_a_training_that_was_killed_gives_the_same_file(tmp_path, monkeypatch) -> None:
    """kill -9 in the middle, then the same words again."""
    straight, killed = tmp_path / "straight", tmp_path / "killed"
    for root in (straight, killed):
        write_library(root)
    assert batch_train.main(words(straight, tasks=18)) == 0

    command = [sys.executable, "-m", "fabric_sim.batch_train", *words(killed, tasks=18)]
    work = killed / ".inspection.work"
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
    deadline = time.monotonic() + 60.0
    while len(list(work.glob("*/*.json"))) < 2:
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.02)
            pytest.fail("it was over before it could be killed")
        assert time.monotonic() < deadline, "nothing was finished in a minute"
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = sorted(work.glob("*/*.json"))
    assert kept
    assert not (killed / "inspection/models.npz").exists()

    ran = []
    run_jobs = batch_train_work.run_jobs
    monkeypatch.setattr(
        batch_train_work, "run_jobs", lambda recipe, jobs: ran.append(1) or run_jobs(recipe, jobs)
    )
    monkeypatch.setattr(batch_train, "spread", lambda processes: map)
    assert batch_train.main(words(killed, tasks=18)) == 0
    types = batch_train.known_types(batch_train.TYPES)
    library = Library.load(killed / "inspection", "inspection")
    chunks = chunks_of(batch_train.jobs_of(library, types, 18, 101), "inspection")
    assert len(ran) == len(chunks) - len(kept)
    same = [(root / "inspection/models.npz").read_bytes() for root in (straight, killed)]
    assert same[0] == same[1]
    assert not work.exists()


@pytest.mark.parametrize("damage", ["empty", "absent", "mismatch"])
def test_a_bad_library_is_refused_and_nothing_is_overwritten(tmp_path, capsys, damage) -> None:
    write_library(tmp_path)
    index, models = tmp_path / "inspection/library.yaml", tmp_path / "inspection/models.npz"
    models.write_bytes(b"of before")
    if damage == "empty":
        index.write_text("")
    elif damage == "absent":
        (tmp_path / "inspection/reactive.pomdpx").unlink()
    else:
        (tmp_path / "inspection/reactive.policy").write_text("<Policy/>")
    before = {path.name: path.read_bytes() for path in index.parent.iterdir()}
    for library in ("keep", "new"):
        assert batch_train.main(words(tmp_path, library=library)) == 2
        assert str(index) in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in index.parent.iterdir()} == before


@pytest.fixture
def builds(monkeypatch) -> list:
    """The plans that were built, each in the time that it takes to copy two models."""
    plans = []

    def build(plan, folder, map_jobs, progress) -> Library:
        plans.append(plan)
        progress(plan.steps, plan.steps)
        return write_library(folder.parent, plan.scenario, folder.name)

    monkeypatch.setattr(batch_library, "build", build)
    return plans


def test_a_new_library_takes_the_place_of_the_old_one_which_is_kept(
    tmp_path, builds, capsys
) -> None:
    write_library(tmp_path)
    (tmp_path / "inspection/of_before.md").write_text("a card")
    assert batch_train.main(words(tmp_path, library="new", policies=7, tasks=2, seed=103)) == 0
    assert [(plan.scenario, plan.seed, plan.size) for plan in builds] == [("inspection", 103, 7)]
    library = Library.load(tmp_path / "inspection", "inspection")
    TrainedModels.load(tmp_path / "inspection/models.npz").check(library)
    assert not (tmp_path / "inspection/of_before.md").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == [".inspection.before", "inspection"]
    assert (tmp_path / ".inspection.before/of_before.md").read_text() == "a card"
    Library.load(tmp_path / ".inspection.before", "inspection")
    assert f"{tmp_path}/.inspection.before: what was there" in capsys.readouterr().out


def test_the_first_stage_is_not_run_again_after_a_kill_in_the_second(
    tmp_path, builds, monkeypatch
) -> None:
    old = write_library(tmp_path)

    def killed(*rest, **words) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(batch_train, "train_models", killed)
        assert batch_train.main(words(tmp_path, library="new", tasks=2)) == 130
    assert Library.load(tmp_path / "inspection", "inspection").hash == old.hash
    assert not (tmp_path / "inspection/models.npz").exists()
    assert batch_train.main(words(tmp_path, library="new", tasks=2)) == 0
    assert len(builds) == 1
    assert (tmp_path / "inspection/models.npz").exists()


def test_a_folder_that_is_no_library_is_never_replaced(tmp_path) -> None:
    (tmp_path / "notes").mkdir()
    check_replaceable(tmp_path / "notes", "inspection")
    (tmp_path / "notes/thesis.txt").write_text("a year of work")
    with pytest.raises(LibraryError, match="notes is not replaced"):
        check_replaceable(tmp_path / "notes", "inspection")
    check_replaceable(tmp_path / "nowhere", "inspection")


@pytest.mark.parametrize("able", [True, False], ids=["exchange", "file system that cannot"])
def test_a_folder_takes_the_place_of_another_which_is_kept(tmp_path, monkeypatch, able) -> None:
    def cannot(one, other) -> None:
        raise OSError("no exchange here")

    if not able:
        monkeypatch.setattr(batch_train_folder, "_exchange", cannot)
    (tmp_path / "target").mkdir()
    for number in (1, 2, 3):
        (tmp_path / "fresh").mkdir()
        (tmp_path / "fresh/file").write_text(str(number))
        assert replace_folder(tmp_path / "fresh", tmp_path / "target") == (number > 1)
        assert (tmp_path / "target/file").read_text() == str(number)
    assert (tmp_path / ".target.before/file").read_text() == "2"
    assert sorted(path.name for path in tmp_path.iterdir()) == [".target.before", "target"]


def test_the_time_of_a_training_is_told_from_a_share_of_it(library) -> None:
    found = measure(library, processes=1, share=12)
    assert found.all_tasks == 16 * 2 * 90
    assert 0 < found.tasks <= found.all_tasks / 10
    assert found.full == pytest.approx(found.seconds * found.all_tasks / found.tasks)
