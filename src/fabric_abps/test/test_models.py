# SPDX-License-Identifier: BSD-3-Clause
"""Performance and observation model, and the file they are kept in."""

import itertools

import numpy as np
import pytest
from conftest import POLICIES, TYPES, run_job
from scipy import stats

from fabric_abps import (
    Library,
    ModelsError,
    ObservationModel,
    PerformanceModel,
    TrainedModels,
    train,
)


def test_performance_is_the_sample_mean_and_variance_of_each_pair() -> None:
    model = PerformanceModel.fit([[[1.0, 3.0], [2.0, 2.0, 5.0]]])
    assert model.mean == pytest.approx(np.array([[2.0, 3.0]]))
    assert model.variance == pytest.approx(np.array([[2.0, 3.0]]))


def test_predictive_distribution_agrees_with_scipy_stats() -> None:
    data = [[[1.0, 3.0, 4.0], [2.0, 2.5, 5.0, 9.0]]]
    model = PerformanceModel.fit(data)
    scale = np.sqrt(model.variance * (1 + 1 / model.count))
    for u in (-3.0, 0.0, 2.7, 12.0):
        expected = stats.t.cdf(u, model.count - 1, model.mean, scale)
        assert model.cdf(u) == pytest.approx(expected, abs=1e-12)
    normal = PerformanceModel.fit(data, predictive="normal")
    expected = stats.norm.cdf(2.7, model.mean, np.sqrt(model.variance))
    assert normal.cdf(2.7) == pytest.approx(expected, abs=1e-12)


def test_a_policy_that_always_earns_the_same_keeps_the_variance_floor() -> None:
    model = PerformanceModel.fit([[[6.0] * 20]], variance_floor=0.04)
    assert model.deviation == pytest.approx(np.array([[0.2]]))
    assert 0.0 < model.cdf(5.9)[0, 0] < 0.5


@pytest.mark.parametrize(
    ("utilities", "message"),
    [
        ([[[1.0]]], "type 0, policy 0: needs two tasks"),
        ([[[1.0, 2.0], [1.0, np.nan]]], "type 0, policy 1: a utility is not finite"),
        ([[[1.0, 2.0]], []], "full table"),
        ([], "full table"),
    ],
)
def test_performance_refuses_bad_data_by_pair(utilities, message) -> None:
    with pytest.raises(ValueError, match=message):
        PerformanceModel.fit(utilities)


def test_likelihood_of_all_sequences_of_a_length_sums_to_one() -> None:
    model = ObservationModel.fit([[[[0, 1, 5], [5, 5]]], [[[63, 33], [2]]]], concentration=3.0)
    total = np.zeros(2)
    for codes in itertools.product(range(64), repeat=2):
        total += np.exp(model.log_likelihood(list(codes), 0))
    assert total == pytest.approx([1.0, 1.0], abs=1e-9)


def test_likelihood_of_a_sequence_worked_by_hand() -> None:
    # one pair, one task 0, 0, 1: transitions start-0, 0-0, 0-1; concentration 2
    model = ObservationModel.fit([[[[0, 0, 1]]]], concentration=2.0)
    # R: code 0 (2 + 1) / 67, code 1 (1 + 1) / 67
    # Q(0 | start) = (1 + 2 R0) / 3, Q(0 | 0) = (1 + 2 R0) / 4, Q(1 | 0) = (1 + 2 R1) / 4
    q_start, q_00, q_01 = (1 + 6 / 67) / 3, (1 + 6 / 67) / 4, (1 + 4 / 67) / 4
    p_start, p_00, p_01 = (1 + 2 * q_start) / 3, (1 + 2 * q_00) / 4, (1 + 2 * q_01) / 4
    assert model.log_likelihood([0, 0, 1], 0) == pytest.approx([np.log(p_start * p_00 * p_01)])
    assert model.probability(0)[0, 0, :2] == pytest.approx([p_00, p_01])
    assert model.probability(0).sum(axis=-1) == pytest.approx(np.ones((1, 65)))


def test_the_order_of_the_codes_tells_types_apart_that_do_the_same_things() -> None:
    taking_turns, one_by_one = [1, 33, 1, 33, 1, 33], [1, 1, 1, 33, 33, 33]
    model = ObservationModel.fit([[[taking_turns] * 5], [[one_by_one] * 5]])
    assert np.argmax(model.log_likelihood(taking_turns, 0)) == 0
    assert np.argmax(model.log_likelihood(one_by_one, 0)) == 1


def test_a_task_taken_apart_anywhere_says_the_same() -> None:
    rng = np.random.default_rng(5)
    data = [[[rng.choice([1, 5, 33], 9) for _ in range(6)] for _ in range(2)] for _ in range(3)]
    model, codes = ObservationModel.fit(data), [33, 33, 1, 5, 1, 33]
    parts = model.contributions(codes, 1)
    for n in range(len(codes)):
        so_far = model.log_likelihood(codes[:n], 1)
        assert so_far == pytest.approx(parts[:n].sum(axis=0))
        rest = model.log_likelihood(codes[n:], 1, previous=codes[n - 1] if n else None)
        assert so_far + rest == pytest.approx(model.log_likelihood(codes, 1))


def test_tasks_of_new_people_of_a_known_type_are_typical_in_the_promised_share() -> None:
    """People of one type differ from each other; a model that forgot that would raise alarms."""
    rng = np.random.default_rng(9)

    def tasks_of_a_person() -> list:
        share = rng.beta(4.0, 4.0)  # of code 1
        return [np.where(rng.random(10) < share, 1, 33) for _ in range(10)]

    training = [task for _ in range(20) for task in tasks_of_a_person()]
    who = [[np.repeat(np.arange(20), 10)]]
    model = ObservationModel.fit([[training]], people=who)
    new = [model.p_values(task, 0)[0] for _ in range(200) for task in tasks_of_a_person()]
    assert np.mean(np.array(new) < 0.1) == pytest.approx(0.1, abs=0.04)


def test_a_long_task_weighs_no_more_than_the_effective_observations() -> None:
    model = ObservationModel.fit([[[[0] * 50] * 9]], concentration=1.0)
    short, long = [0] * 8, [0] * 800
    assert model.log_likelihood(short, 0, 8) == pytest.approx(model.log_likelihood(short, 0))
    ratio = model.log_likelihood(long, 0, 8) / model.log_likelihood(long, 0)
    assert ratio == pytest.approx([0.01])


def test_an_empty_task_says_nothing() -> None:
    model = ObservationModel.fit([[[[0, 1]]], [[[2]]]])
    assert (model.log_likelihood([], 0) == 0.0).all()


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        ([64], r"code \[0\] is 64"),
        ([0, -1], r"code \[1\] is -1"),
        ([0.5], "integers"),
        ([[0, 1]], r"shape \(1, 2\)"),
        (5, r"shape \(\)"),
    ],
)
def test_codes_out_of_range_are_refused_by_place(codes, message) -> None:
    with pytest.raises(ValueError, match="type 0, policy 0, task 0: .*" + message):
        ObservationModel.fit([[[codes]]])


@pytest.fixture
def models(library) -> TrainedModels:
    return train(library, TYPES, run_job, tasks=20, seed=3)


def test_saved_models_come_back_bit_for_bit(models, library, tmp_path) -> None:
    models.save(tmp_path / "m.npz")
    again = TrainedModels.load(tmp_path / "m.npz")
    again.check(library)
    assert (again.types, again.policies) == (TYPES, POLICIES)
    assert (again.observation.counts == models.observation.counts).all()
    assert (again.performance.mean == models.performance.mean).all()
    codes = [33, 5, 17]
    ours, theirs = again.observation, models.observation
    assert (ours.log_likelihood(codes, 1) == theirs.log_likelihood(codes, 1)).all()
    assert (ours.p_values(codes, 1) == theirs.p_values(codes, 1)).all()
    again.save(tmp_path / "n.npz")
    assert (tmp_path / "m.npz").read_bytes() == (tmp_path / "n.npz").read_bytes()


def test_models_of_a_changed_library_are_refused(models, library, index) -> None:
    (index.parent / "helps.pomdpx").write_text("<!-- changed -->")
    with pytest.raises(ModelsError, match="has changed since the training"):
        models.check(library)


def test_a_part_knows_fewer_types_and_policies_and_of_them_the_same(models, library) -> None:
    smaller = Library(library.scenario, library.policies[:0:-1], "helps", library.index)
    part = models.part(smaller, TYPES[1:])
    part.check(smaller)
    assert (part.types, part.policies) == (TYPES[1:], ("asks", "helps"))
    assert (part.performance.mean == models.performance.mean[1:, :0:-1]).all()
    alone = train(smaller, TYPES[1:], run_job, tasks=20, seed=3).observation
    codes = [33, 5, 17]
    assert (part.observation.log_likelihood(codes, 0) == alone.log_likelihood(codes, 0)).all()


def test_a_part_of_what_was_not_trained_is_refused(models, library) -> None:
    with pytest.raises(ModelsError, match="not trained on bold"):
        models.part(library, ["calm", "bold"])


def _rewrite(path, **changes) -> None:
    with np.load(path) as archive:
        data = {key: archive[key] for key in archive.files}
    data.update(changes)
    np.savez(path, **{key: value for key, value in data.items() if value is not None})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"typicality": None}, "'typicality' is missing"),
        ({"format": 7}, "format 7"),
        ({"types": np.array(["calm", "calm", "hasty"])}, "types: must be distinct"),
        ({"types": np.array(["calm"])}, "not \\(1, 3\\)"),
        ({"utility_mean": np.full((3, 3), np.nan)}, "type 0, policy 0: mean utility"),
        ({"transitions": np.full((3, 3, 65, 64), -1)}, "negative"),
        ({"predictive": "guess"}, "'guess' is none of"),
        ({"seed": np.array(np.inf)}, "infinity"),
        ({"scenario": np.array([{}], dtype=object)}, "pickle"),
    ],
)
def test_damaged_files_are_refused_by_entry(models, tmp_path, changes, message) -> None:
    path = tmp_path / "m.npz"
    models.save(path)
    _rewrite(path, **changes)
    with pytest.raises(ModelsError, match=f"m.npz: .*{message}"):
        TrainedModels.load(path)


def test_files_that_are_no_models_are_refused(tmp_path) -> None:
    with pytest.raises(ModelsError, match="cannot be read"):
        TrainedModels.load(tmp_path / "absent.npz")
    (tmp_path / "text.npz").write_text("hello")
    with pytest.raises(ModelsError, match="not a file of trained models"):
        TrainedModels.load(tmp_path / "text.npz")
    (tmp_path / "empty.npz").write_bytes(b"")
    with pytest.raises(ModelsError, match="empty.npz"):
        TrainedModels.load(tmp_path / "empty.npz")


def test_a_file_with_wrong_bytes_is_refused_wherever_they_are(models, tmp_path) -> None:
    path = tmp_path / "m.npz"
    models.save(path)
    whole, refused = path.read_bytes(), 0
    for place in range(0, len(whole), max(1, len(whole) // 200)):
        path.write_bytes(whole[:place] + b"\xff\xff\xff" + whole[place + 3 :])
        try:
            TrainedModels.load(path)  # bytes that nobody reads may be anything
        except ModelsError as error:
            refused += str(path) in str(error)
    assert refused > 150
