# SPDX-License-Identifier: BSD-3-Clause
"""Somebody at the keys: every action is reachable, and the truth follows what the person does."""

import threading

import pytest

from fabric_msgs.srv import HumanCommandRequest
from fabric_sim.character import CharacterError, named_generator
from fabric_sim.manual_commands import COMMANDS, NAMES, command_of_key
from fabric_sim.manual_worker import ManualStaff, ManualWorker
from fabric_sim.staff import Staff
from fabric_sim.worker_events import (
    HELD_BY_NOBODY,
    HELD_BY_PERSON,
    HELD_BY_ROBOT,
    ROBOT_GRASP,
    EventKind,
    RobotView,
    WorldView,
)
from fabric_sim.worker_parameters import WorkerParameters

RULES = {1: "red", 2: "green"}
GRASPING = RobotView(ROBOT_GRASP, 1)
RESTING = RobotView()


class Desk:
    """A person at work with a cube at the pick point and somebody at the keys."""

    def __init__(self, scenario="inspection", begin=True):
        self.worker = ManualWorker(named_generator(101, "worker"))
        rules = RULES if scenario == "sorting" else None
        self.worker.start_task(0.0, scenario, named_generator(101, "worker", 1), rules)
        self.t, self.tick = 0.0, 0
        self.robot, self.cube, self.held = RESTING, True, HELD_BY_NOBODY
        self.events = []
        if begin:
            self.press("begin")
            self.worker.start_subtask(0.0, 1)
            self.run(0.1)

    def press(self, name, container=""):
        accepted, reason = self.worker.command(name, container)
        assert accepted, reason
        return self

    def refused(self, name, container=""):
        accepted, reason = self.worker.command(name, container)
        assert not accepted
        return reason

    def run(self, seconds):
        for _ in range(round(seconds / 0.05)):
            self.tick += 1
            self.t = round(self.tick * 0.05, 6)
            for event in self.worker.step(self.t, self.robot, WorldView(self.cube, self.held)):
                self._take(event)
        return self

    def _take(self, event):
        self.events.append(event)
        if event.kind is EventKind.PICKED_CUBE:
            self.cube, self.held = False, HELD_BY_PERSON
        elif event.kind is EventKind.RELEASED:
            self.cube, self.held = True, HELD_BY_NOBODY
        elif event.kind is EventKind.PLACED_CUBE:
            self.held = HELD_BY_NOBODY
            self.worker.end_subtask(self.t, event.correct, by_person=True)

    def kinds(self):
        return [event.kind for event in self.events]

    def word(self):
        return self.worker.truth(self.t).anticipated_state


def test_the_words_are_the_constants_of_the_service():
    assert [getattr(HumanCommandRequest, name.upper()) for name in NAMES] == list(range(len(NAMES)))
    assert len({command.key for command in COMMANDS}) == len(COMMANDS)


def test_keys_stand_for_commands_and_digits_for_trays():
    assert command_of_key("G", []) == ("grasp", "")
    assert command_of_key(" ", []) == ("begin", "")
    assert command_of_key("2", ["red", "green"]) == ("place", "green")
    assert command_of_key("3", ["red", "green"]) is None
    assert command_of_key("x", []) is None


def test_time_stands_until_somebody_begins_and_again_in_the_next_task():
    desk = Desk(begin=False)
    assert not desk.worker.ready
    assert "press begin first" in desk.refused("grasp")
    desk.press("begin")
    assert desk.worker.ready
    assert "running already" in desk.refused("begin")
    desk.worker.end_task(1.0, True)
    assert desk.refused("grasp") == "no task is running"
    desk.worker.start_task(1.0, "inspection", named_generator(101, "worker", 2))
    assert not desk.worker.ready


def test_nothing_happens_without_a_command():
    desk = Desk().run(40.0)
    assert {event.kind for event in desk.events} <= {EventKind.STARTED_ACTION}
    assert (desk.worker.action, desk.worker.state) == ("idle", "evaluating")


def test_a_grasp_lifts_the_package_and_puts_it_away_in_the_time_of_a_simulated_person():
    desk = Desk().press("grasp").run(0.5)
    assert (desk.worker.action, desk.worker.holding) == ("grasp", False)
    desk.run(2.5)
    assert desk.worker.holding
    desk.run(20.0)
    placed = desk.events[desk.kinds().index(EventKind.PLACED_CUBE)]
    assert (placed.container, placed.correct) == ("inspected", True)
    timing = WorkerParameters.load().timing.inspection
    slowest = 1.0 + sum(timing.slowness.values())
    longest = slowest * (timing.reach.most + timing.carry.most)
    assert timing.reach.least + timing.carry.least < placed.t < longest
    assert desk.worker.state == "success"
    assert desk.worker.action == "idle"


def test_the_second_key_fails_to_lift_or_drops_the_package():
    desk = Desk().press("grasp").run(0.2).press("drop").run(0.1)
    assert (desk.worker.action, desk.worker.state) == ("idle", "failed_to_grasp")
    assert desk.word() == "may_not_be_capable"
    desk.run(3.0).press("grasp").run(3.0)
    assert desk.worker.holding
    desk.press("drop").run(0.1)
    assert desk.kinds().count(EventKind.RELEASED) == 1
    assert not desk.worker.holding
    assert desk.word() in ("needs_help", "does_not_need_help")
    assert desk.refused("drop") == "there is nothing to drop"


def test_the_package_cannot_be_dropped_once_it_is_put_away():
    desk = Desk().press("grasp")
    while EventKind.PLACED_CUBE not in desk.kinds():
        desk.run(0.05)
    assert desk.refused("drop") == "there is nothing to drop"
    assert desk.worker.counters.failed == 0


@pytest.mark.parametrize(("tray", "correct"), [("red", True), ("green", False)])
def test_the_person_chooses_the_tray_when_sorting(tray, correct):
    desk = Desk("sorting").press("grasp").run(4.0)
    assert desk.worker.holding
    assert EventKind.PLACED_CUBE not in desk.run(10.0).kinds()
    assert "there is no tray 'blue'; there are: green, red" in desk.refused("place", "blue")
    assert "no tray ''" in desk.refused("place")
    desk.press("place", tray).run(6.0)
    placed = desk.events[desk.kinds().index(EventKind.PLACED_CUBE)]
    assert (placed.container, placed.correct) == (tray, correct)


def test_the_tray_may_be_chosen_while_the_hand_still_reaches():
    desk = Desk("sorting").press("grasp").run(0.1).press("place", "green").run(8.0)
    assert EventKind.PLACED_CUBE in desk.kinds()


def test_looking_around_lasts_and_needs_a_reminder():
    desk = Desk().press("look_around").run(1.0)
    assert desk.worker.looking_around
    assert desk.word() == "may_be_distracted"
    words = {desk.run(0.5).word() for _ in range(60)}
    assert desk.worker.looking_around
    assert "needs_to_be_reminded" in words
    desk.press("idle").run(0.1)
    assert (desk.worker.looking_around, desk.worker.state) == (False, "evaluating")


def test_looking_around_goes_on_when_the_robot_has_sorted_a_cube():
    desk = Desk("sorting").press("look_around").run(3.0)
    desk.worker.end_subtask(desk.t, True, by_person=False)
    desk.run(1.0)
    desk.worker.start_subtask(desk.t, 2)
    desk.run(5.0)
    assert (desk.worker.action, desk.worker.state) == ("look_around", "no_attention")


def test_walking_away_and_coming_back_take_their_time():
    desk = Desk().press("walk_away").run(1.0)
    assert (desk.worker.action, desk.worker.state) == ("walk_away", "tired")
    assert desk.word() == "needs_help"
    assert "on your way out" in desk.refused("grasp")
    desk.run(60.0)
    assert not desk.worker.detected
    assert desk.worker.state == "recovery"
    assert desk.refused("grasp") == "you are away: come back first"
    desk.press("come_back").run(1.0)
    assert not desk.worker.detected
    desk.run(8.0)
    assert desk.worker.detected
    assert desk.worker.state == "evaluating"
    assert desk.refused("come_back") == "you are not away"
    assert [k for k in desk.kinds() if k in (EventKind.LEFT, EventKind.RETURNED)] == [
        EventKind.LEFT,
        EventKind.RETURNED,
    ]


def test_the_next_cube_does_not_bring_somebody_back():
    desk = Desk("sorting").press("walk_away").run(10.0)
    desk.worker.end_subtask(desk.t, True, by_person=False)
    desk.worker.start_subtask(desk.t, 2)
    desk.run(5.0)
    assert (desk.worker.detected, desk.worker.state) == (False, "recovery")


def test_watching_the_robot_grasp_is_letting_it_help():
    desk = Desk()
    desk.robot = GRASPING
    desk.run(5.0)
    assert desk.worker.state == "robot_interfered"
    assert desk.word() == "needs_help"
    desk.robot = RESTING
    desk.run(0.1)
    assert desk.worker.state == "evaluating"
    assert (desk.worker.interferences, desk.worker.refusals) == (1, 0)


def test_a_warning_lasts_until_the_robot_gives_way():
    desk = Desk()
    desk.robot = GRASPING
    desk.run(1.0).press("warn").run(8.0)
    assert (desk.worker.action, desk.worker.state) == ("warn", "warns_the_robot")
    assert desk.kinds().count(EventKind.WARNED) >= 2
    desk.robot = RESTING
    desk.run(3.2)
    assert desk.worker.state in ("robot_receives_the_warning", "evaluating")
    assert desk.worker.truth(desk.t).interferences == 1


def test_after_a_warning_a_failure_is_forgotten_as_with_simulated_people():
    desk = Desk().press("grasp").run(0.2).press("drop").run(0.1)
    assert desk.word() == "may_not_be_capable"
    desk.press("warn").run(3.2)
    assert desk.worker.counters.failed == 0


def test_a_warning_to_a_robot_at_rest_is_one_gesture():
    desk = Desk().press("warn").run(8.0)
    assert desk.kinds().count(EventKind.WARNED) == 1
    assert desk.worker.refusals == 0
    assert desk.worker.action == "idle"


def test_what_makes_no_sense_is_refused_with_a_reason():
    desk = Desk()
    assert "unknown command 'sing'; there are: idle" in desk.refused("sing")
    assert desk.refused("place") == "there is nothing to place: grasp first"
    desk.cube = False
    desk.run(0.1)
    assert desk.refused("grasp") == "no cube waits at the pick point"
    desk.held = HELD_BY_ROBOT
    desk.run(0.1)
    assert desk.refused("grasp") == "the robot holds the cube"
    desk.cube, desk.held = True, HELD_BY_NOBODY
    desk.run(0.1).press("grasp").run(0.2)
    assert desk.refused("grasp") == "your hand reaches already"
    desk.run(3.0)
    assert "your hand is full" in desk.refused("walk_away")


def test_a_cube_that_goes_before_the_hand_is_there_is_not_lifted():
    desk = Desk().press("grasp").run(0.2)
    desk.cube, desk.held = False, HELD_BY_ROBOT
    desk.run(4.0)
    assert EventKind.PICKED_CUBE not in desk.kinds()
    assert desk.worker.action == "idle"


def test_commands_of_many_threads_are_all_taken_in():
    desk = Desk()
    threads = [
        threading.Thread(target=lambda: [desk.worker.command("warn") for _ in range(50)])
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    desk.run(0.1)
    assert desk.kinds().count(EventKind.WARNED) == 200


def test_one_person_sits_at_the_keys_in_every_task_and_never_in_a_headless_run():
    staff = ManualStaff(101)
    assert staff.worker(1) is staff.worker(7)
    assert staff.worker(1).truth(0.0).human_type == "manual"
    with pytest.raises(CharacterError, match="needs somebody at the keys"):
        Staff("manual", 101)
