# SPDX-License-Identifier: BSD-3-Clause
"""The person of the short-term study: moods by a schedule, by seed, over one history."""

import copy

import pytest
import yaml

from fabric_sim import drift
from fabric_sim.drift import NORMAL, DriftError, DriftingStaff, DriftParameters
from fabric_sim.staff import Staff
from fabric_sim.worker_events import RobotView, WorldView
from fabric_sim.worker_model import ModelLibrary
from fabric_sim.worker_parameters import WorkerParameters, default_path

TASKS = range(1, 41)


@pytest.fixture(scope="module")
def parameters() -> DriftParameters:
    return DriftParameters.load()


@pytest.fixture(scope="module")
def hire(parameters):
    """Make the person of a seed; the numbers of the workers are read once."""
    workers = WorkerParameters.load()
    library = ModelLibrary(workers.model)
    return lambda seed: DriftingStaff(seed, parameters, workers, library)


@pytest.fixture
def content() -> dict:
    return yaml.safe_load(default_path().with_name("drift.yaml").read_text(encoding="utf-8"))


def test_everybody_is_normal_in_the_first_task(parameters):
    assert parameters.chances(1)[NORMAL] == 1.0


def test_every_mood_becomes_likelier_task_by_task_and_normal_rarer(parameters):
    course = [parameters.chances(number) for number in TASKS]
    for before, after in zip(course, course[1:], strict=False):
        assert after[NORMAL] <= before[NORMAL]
        assert all(after[mood.name] >= before[mood.name] for mood in parameters.moods)
    assert all(course[-1][mood.name] > course[0][mood.name] for mood in parameters.moods)


def test_chances_of_a_task_are_a_distribution(parameters):
    for number in TASKS:
        chances = parameters.chances(number).values()
        assert min(chances) >= 0.0
        assert sum(chances) == pytest.approx(1.0, abs=1e-12)


def test_moods_come_as_often_as_the_schedule_says(parameters, hire):
    staffs = [hire(seed) for seed in range(101, 501)]
    for number in (5, 15, 40):
        moods = [staff.mood(number) for staff in staffs]
        for name, chance in parameters.chances(number).items():
            error = 4.0 * (chance * (1.0 - chance) / len(moods)) ** 0.5
            assert moods.count(name) / len(moods) == pytest.approx(chance, abs=error + 1e-12)


def test_the_seed_decides_person_and_moods_whatever_was_asked_before(hire):
    one, other = hire(101), hire(101)
    for number in (40, 3, 17):
        other.worker(number)
    assert one.person == other.person
    assert [one.mood(n) for n in TASKS] == [other.mood(n) for n in TASKS]
    assert one.person != hire(102).person


def test_two_people_in_three_trust_the_robot(parameters, hire):
    people = [hire(seed).person for seed in range(101, 701)]
    trusting = sum(p.collaborativeness >= parameters.trusting[0] for p in people) / len(people)
    assert trusting == pytest.approx(parameters.trust_share, abs=0.08)


def test_a_mood_moves_its_dials_and_leaves_the_others(parameters, hire):
    person = hire(101).person
    for mood in parameters.moods:
        moved = mood.applied(person)
        for dial in drift.DIALS:
            if dial in mood.dials:
                assert getattr(moved, dial) < getattr(person, dial)
            else:
                assert getattr(moved, dial) == getattr(person, dial)


def first_task_of(staff: DriftingStaff, mood: str) -> int:
    return next(number for number in range(1, 500) if staff.mood(number) == mood)


def test_the_same_worker_goes_on_with_its_history_through_the_moods(hire):
    staff = hire(101)
    worker = staff.worker(1)
    worker.person.worked("inspection", by_person=True)
    tired = staff.worker(first_task_of(staff, "tired"))
    assert tired is worker
    assert tired.person.history.work == 1.0
    assert tired.person.now.stamina < 0.3 * staff.person.stamina
    assert staff.worker(1).person.character == staff.person


def test_a_stubborn_person_refuses_what_the_same_person_accepts_on_a_normal_day(hire):
    staff = hire(101)
    normal = staff.worker(1).person.refusal("failed_to_grasp", 0.0, "inspection")
    stubborn = staff.worker(first_task_of(staff, "stubborn")).person
    assert stubborn.refusal("failed_to_grasp", 0.0, "inspection") > normal
    assert staff.worker(1).person.refusal("failed_to_grasp", 0.0, "inspection") == pytest.approx(
        normal
    )


def test_a_drifting_worker_works(hire):
    worker = hire(101).worker(1)
    worker.start_task(0.0, "inspection")
    worker.start_subtask(0.0)
    events = [e for tick in range(200) for e in worker.step(tick * 0.05, RobotView(), WorldView())]
    assert events


def test_task_numbers_begin_with_1(hire):
    with pytest.raises(ValueError, match="task number is 0"):
        hire(101).mood(0)


def changed(content: dict, path: tuple[str, ...], value: object) -> dict:
    content = copy.deepcopy(content)
    place = content
    for key in path[:-1]:
        place = place[key]
    if value is None:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return content


BAD = [
    (("moods", "tired", "most"), float("nan"), "moods.tired.most: nan is not finite"),
    (("moods", "tired", "most"), float("inf"), "moods.tired.most: inf is not finite"),
    (("moods", "tired", "most"), 1.2, "moods.tired.most: 1.2 is outside"),
    (("moods", "tired", "most"), 0.9, "sum to"),
    (("moods", "tired", "most"), True, "True is not a number"),
    (("moods", "tired", "full_from"), float("nan"), "moods.tired.full_from: nan"),
    (("moods", "tired", "never_until"), 60, "never_until < full_from"),
    (("moods", "tired", "full_from"), None, "moods.tired.full_from: missing"),
    (("moods", "tired", "often"), 1, "unknown 'often'"),
    (("moods", "tired", "dials", "mass"), {"to": 0.0, "by": 1.0}, "unknown 'mass'"),
    (("moods", "tired", "dials", "stamina"), {"to": 0.0}, "stamina.by: missing"),
    (("moods", "tired", "dials", "stamina"), {"to": -0.1, "by": 1.0}, "-0.1 is outside"),
    (("moods", "tired", "dials"), {}, "expected a mapping of dials"),
    (("moods", "normal"), {}, "normal is what the moods leave"),
    (("moods",), {}, "expected a mapping of moods"),
    (("trust", "share"), -0.5, "trust.share: -0.5 is outside"),
    (("trust", "wary"), [0.3], "expected .least, most."),
    (("person", "stamina"), [0.9, 0.2], "least 0.9 is above most 0.2"),
    (("person", "stamina"), [0.9, "x"], "'x' is not a number"),
    (("person",), [], "person: expected a mapping"),
]


@pytest.mark.parametrize(("path", "value", "complaint"), BAD)
def test_numbers_that_cannot_be_meant_are_refused_by_name(content, path, value, complaint):
    with pytest.raises(DriftError, match=complaint) as refused:
        DriftParameters.parse(changed(content, path, value), "drift.yaml")
    assert str(refused.value).startswith("drift.yaml")


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(DriftError, match="nowhere.yaml"):
        DriftParameters.load(tmp_path / "nowhere.yaml")


def test_a_drifting_person_can_be_asked_for_by_name():
    people = Staff("drifting", 101)
    own = DriftingStaff(101)
    for number in (1, 30, 40):
        assert people.worker(number).person.character == own.worker(number).person.character
    assert people.worker(41) is people.worker(42)
