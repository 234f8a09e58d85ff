# SPDX-License-Identifier: BSD-3-Clause
"""Line 1 of Algorithm 1: whom the policies are run with, and what is made of it."""

import numpy as np
import pytest
from conftest import CODES, EMISSION, POLICIES, TYPES, UTILITY, run_job

from fabric_abps import child_seed, train
from fabric_abps.train import SESSION, jobs_of, sessions


def test_training_counts_what_it_saw_and_is_the_same_through_any_map(library) -> None:
    def backwards(function, jobs):
        return list(reversed([function(job) for job in reversed(list(jobs))]))

    models = train(library, TYPES, run_job, tasks=40, seed=11)
    again = train(library, TYPES, run_job, tasks=40, seed=11, map_jobs=backwards)
    assert (again.observation.counts == models.observation.counts).all()
    assert (again.observation.typicality == models.observation.typicality).all()
    assert (again.performance.mean == models.performance.mean).all()
    assert models.observation.counts.sum() == 3 * 3 * 40 * 12
    for i, tau in enumerate(TYPES):
        seen = models.observation.counts[i].sum(axis=(0, 1))
        assert seen[CODES] / (3 * 40 * 12) == pytest.approx(EMISSION[tau], abs=0.05)
        assert models.performance.mean[i] == pytest.approx(UTILITY[tau], abs=0.6)


@pytest.mark.parametrize("tasks", [2, 3, 30, 89, 90, 91, 400])
def test_the_tasks_of_a_pair_are_shared_evenly_among_people_who_go_on(tasks) -> None:
    shares = sessions(tasks)
    assert sum(shares) == tasks
    assert max(shares) - min(shares) <= 1
    assert max(shares) <= SESSION
    assert len(shares) >= min(tasks, 3)


def test_everybody_is_somebody_else(library) -> None:
    jobs = jobs_of(library, TYPES, 90, 5)
    assert len({job.seed for job in jobs}) == len(jobs) == 3 * 3 * 3
    assert sum(job.tasks for job in jobs) == 3 * 3 * 90
    other = jobs_of(library, TYPES, 90, 6)
    assert not {job.seed for job in jobs} & {job.seed for job in other}


def test_training_refuses_what_a_person_must_not_return(library) -> None:
    def lost(job):
        return [(float("nan"), [1])] * job.tasks

    with pytest.raises(ValueError, match="policy waits with calm, seed .*: utility nan of task 1"):
        train(library, TYPES, lost, tasks=2, seed=1)
    with pytest.raises(ValueError, match=r"policy waits with calm, .*: task 1: code \[0\] is 99"):
        train(library, TYPES, lambda job: [(1.0, [99])] * job.tasks, tasks=2, seed=1)
    with pytest.raises(ValueError, match="policy waits with calm, .*: 0 tasks instead of 10"):
        train(library, TYPES, lambda job: [], tasks=30, seed=1)
    with pytest.raises(ValueError, match="tasks must be 2"):
        train(library, TYPES, run_job, tasks=1, seed=1)


@pytest.mark.parametrize("change", [lambda done: done[:-1], lambda done: [*done, done[0]]])
def test_a_map_that_loses_or_adds_results_is_refused(library, change) -> None:
    def wrong(function, jobs):
        return change([function(job) for job in jobs])

    with pytest.raises(ValueError, match="one result for each of 27 jobs"):
        train(library, TYPES, run_job, tasks=3, seed=1, map_jobs=wrong)


def test_progress_counts_tasks(library) -> None:
    done = []
    train(library, TYPES, run_job, tasks=5, seed=1, progress=lambda *pair: done.append(pair))
    assert done[-1] == (45, 45)
    assert np.diff([0, *(so_far for so_far, _ in done)]).tolist() == [2, 2, 1] * 9


def test_child_seeds_differ_by_name_and_fit_in_63_bits() -> None:
    seeds = {child_seed(1, policy, tau) for policy in POLICIES for tau in TYPES}
    assert len(seeds) == 9
    assert all(0 <= seed < 2**63 for seed in seeds)
    assert child_seed(1, "a") != child_seed(2, "a")
