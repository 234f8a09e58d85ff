#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""decision_node and motion_node through their topics, services and actions."""

import math
import sys
import threading
import unittest
from collections import defaultdict

import actionlib
import rosgraph
import rospkg
import rospy
import rostest
from std_msgs.msg import Header

from fabric_msgs.msg import (
    ConveyorState,
    Cube,
    CubeArray,
    Decision,
    ExecuteRobotActionAction,
    ExecuteRobotActionGoal,
    ExecuteRobotActionResult,
    Heartbeat,
    ModelInfo,
    MoveArmAction,
    MoveArmResult,
    Observation,
    RobotActionState,
    SafetyState,
    TaskState,
)
from fabric_msgs.srv import Command, SetModel, SetSuction, SetSuctionResponse, Stop
from fabric_msgs.traffic import introduce

DEADLINE = 30.0  # s of wall time
LOST = 3.0  # s after which a connection that is not there will not come by itself
HEARD = {
    "decision": Decision,
    "model_info": ModelInfo,
    "robot/state": RobotActionState,
    "safety/state": SafetyState,
    "heartbeat": Heartbeat,
}
TOLD = {
    "observation": Observation,
    "wanted": Decision,
    "conveyor/state": ConveyorState,
    "cell/cubes": CubeArray,
    "task/state": TaskState,
    "human/warning": Header,
}


class World:
    """Everything around the two nodes: remembers what they say, serves a pretend arm."""

    def __init__(self):
        self.changed = threading.Condition()
        self.heard = defaultdict(list)
        self.goals = []
        self.suction = []
        self.tell = {
            topic: rospy.Publisher(topic, kind, queue_size=100, latch=topic == "task/state")
            for topic, kind in TOLD.items()
        }
        self.ears = [
            rospy.Subscriber(topic, kind, self.note, callback_args=topic)
            for topic, kind in HEARD.items()
        ]
        self.arm = actionlib.ActionServer(
            "arm/move", MoveArmAction, self.on_goal, self.on_cancel, False
        )
        self.arm.start()
        rospy.Service("arm/set_suction", SetSuction, self.on_suction)

    def note(self, message, topic):
        with self.changed:
            self.heard[topic].append(message)
            self.changed.notify_all()

    def on_goal(self, handle):
        with self.changed:
            handle.set_accepted()
            self.goals.append(handle)
            self.changed.notify_all()

    def on_cancel(self, handle):
        handle.set_canceled(MoveArmResult(MoveArmResult.PRE_EMPTED, "cancelled"))

    def on_suction(self, request):
        with self.changed:
            self.suction.append(request.on)
            self.changed.notify_all()
        return SetSuctionResponse(True, "")

    def wait(self, condition, what):
        with self.changed:
            if not self.changed.wait_for(condition, DEADLINE):
                raise AssertionError(f"waited {DEADLINE} s for {what}")

    def connect(self):
        """Wait until everybody is connected; make anew what rospy has lost."""
        for _ in range(int(DEADLINE / LOST)):
            with self.changed:
                if self.changed.wait_for(lambda: not self.unconnected(), LOST):
                    return
            introduce(self.unconnected())
        raise AssertionError(f"no connection of {', '.join(self.unconnected())}")

    def unconnected(self):
        """Topics of ours on which somebody the master knows of is not connected."""
        publishers, subscribers, _ = map(dict, rosgraph.Master(rospy.get_name()).getSystemState())
        told = [*self.tell.values(), self.arm.result_pub]
        heard = [*self.ears, self.arm.goal_sub, self.arm.cancel_sub]
        ends = [(end, subscribers) for end in told] + [(end, publishers) for end in heard]
        return [
            end.resolved_name
            for end, others in ends
            if end.get_num_connections() < max(1, len(others.get(end.resolved_name, [])))
        ]

    def last(self, topic):
        return self.heard[topic][-1] if self.heard[topic] else None

    def handled(self, node, topic):
        """How many messages of a topic the node says it has dealt with."""
        beats = [beat for beat in self.heard["heartbeat"] if beat.node == node]
        counts = {entry.topic: entry.count for entry in beats[-1].handled} if beats else {}
        return counts.get(topic, 0)

    def say(self, node, topic, message):
        """Publish a message and wait until the node has dealt with it."""
        counted = "decision" if topic == "wanted" else topic
        before = self.handled(node, counted)
        self.tell[topic].publish(message)
        self.wait(lambda: self.handled(node, counted) > before, f"{node} to handle {topic}")


class NodesTest(unittest.TestCase):
    """Each test begins with a task of its own."""

    world = None
    tasks = 0
    observations = 0
    decisions = 0

    def setUp(self):
        w = self.world
        w.wait(lambda: w.last("robot/state") and w.last("model_info"), "the nodes")
        w.connect()

    def until(self, condition):
        """For conditions nobody announces."""
        with self.world.changed:
            for _ in range(int(DEADLINE / 0.1)):
                if condition():
                    return
                self.world.changed.wait(0.1)
        self.fail("a condition never came true")

    # -- decision node --------------------------------------------------------------------------

    def observe(self, **fields):
        """Publish the next observation; return its sequence number."""
        NodesTest.observations += 1
        message = Observation(sequence=self.observations, task_id=self.tasks, detected=True)
        message.trigger = Observation.TRIGGER_ACTION_CHANGE
        for name, value in fields.items():
            setattr(message, name, value)
        self.world.tell["observation"].publish(message)
        return self.observations

    def answer(self, sequence):
        """The decision on an observation."""
        w = self.world
        decided = [d for d in w.heard["decision"] if d.observation_sequence == sequence]
        if not decided:
            w.wait(
                lambda: any(d.observation_sequence == sequence for d in w.heard["decision"]),
                f"decision on {sequence}",
            )
            return self.answer(sequence)
        return decided[-1]

    def new_task(self):
        NodesTest.tasks += 1

    def test_decisions_answer_observations_in_order(self):
        self.new_task()
        asked = [self.observe(idle=n % 2 == 0) for n in range(6)]
        self.answer(asked[-1])
        decided = [d for d in self.world.heard["decision"] if d.task_id == self.tasks]
        self.assertEqual([d.observation_sequence for d in decided], asked)
        for d in decided:
            self.assertAlmostEqual(sum(d.belief), 1.0, places=9)
            self.assertLessEqual(d.lower_bound, d.upper_bound + 1e-9)
            self.assertEqual(d.model_hash, self.world.last("model_info").hash)
        sent = {e.topic: e.count for e in self.beat("decision").sent}
        self.assertGreaterEqual(sent["decision"], len(asked))

    def beat(self, node):
        return [b for b in self.world.heard["heartbeat"] if b.node == node][-1]

    def test_a_bad_observation_kills_nothing(self):
        self.new_task()
        bad = self.observe(waiting_time=math.nan)
        good = self.observe(idle=True)
        self.answer(good)
        answered = [d.observation_sequence for d in self.world.heard["decision"]]
        self.assertNotIn(bad, answered)

    def test_the_belief_starts_again_with_a_task(self):
        self.new_task()
        first = self.answer(self.observe(idle=True)).belief
        self.answer(self.observe(idle=True))
        self.new_task()
        self.assertEqual(self.answer(self.observe(idle=True)).belief, first)

    def test_models_are_exchanged_or_refused_with_a_reason(self):
        models = rospkg.RosPack().get_path("fabric_planner") + "/models/"
        rospy.wait_for_service("planner/set_model", DEADLINE)
        set_model = rospy.ServiceProxy("planner/set_model", SetModel)
        refused = set_model(models + "none_such.pomdpx", False)
        self.assertFalse(refused.accepted)
        self.assertIn("none_such.pomdpx", refused.reason)
        self.assertEqual(refused.info.name, "inspection_proactive")
        accepted = set_model(models + "inspection_reactive.pomdpx", True)
        self.assertTrue(accepted.accepted, accepted.reason)
        self.world.wait(
            lambda: self.world.last("model_info").hash == accepted.info.hash, "the new model_info"
        )
        self.assertTrue(accepted.info.fully_observable)
        self.assertTrue(set_model(models + "inspection_proactive.pomdpx", False).accepted)

    # -- motion node ----------------------------------------------------------------------------

    def start_task(self):
        """A task runs, the arm is at home and a package stands at the pick point."""
        self.new_task()
        state = TaskState(task_id=self.tasks, status=TaskState.RUNNING, scenario="inspection")
        self.world.say("motion", "task/state", state)
        self.drive(0)
        self.cube(True)

    def cube(self, present):
        self.world.say("motion", "conveyor/state", ConveyorState(cube_at_pick_point=present))
        cubes = [Cube(where=Cube.WHERE_PICK_POINT, confidence=1.0)] if present else []
        self.world.say("motion", "cell/cubes", CubeArray(cubes=cubes))

    def decide(self, action):
        NodesTest.decisions += 1
        message = Decision(sequence=self.decisions, action=action, task_id=self.tasks)
        self.world.say("motion", "wanted", message)

    def reach(self):
        """The arm reaches the newest goal."""
        w = self.world
        before = w.handled("motion", "arm/move/result")
        w.goals[-1].set_succeeded(MoveArmResult(MoveArmResult.REACHED, ""))
        w.wait(lambda: w.handled("motion", "arm/move/result") > before, "the result's effect")

    def drive(self, least):
        """Reach goal after goal until no new one comes; at least this many."""
        done = 0
        while self.active():
            pose = self.world.goals[-1].get_goal().pose.position
            lifts = self.world.suction and self.world.suction[-1] and pose.z > 0.05
            if lifts:
                self.cube(False)
            self.reach()
            done += 1
        self.assertGreaterEqual(done, least)

    def active(self):
        """True when a goal stands out. Goals were sent before the heartbeat that we waited for,
        on another connection: the count in the heartbeat says how many there are."""
        w = self.world
        sent = {e.topic: e.count for e in self.beat("motion").sent}["arm/move/goal"]
        w.wait(lambda: len(w.goals) >= sent, "the goals that were sent")
        return w.goals and w.goals[-1].get_goal_status().status == actionlib.GoalStatus.ACTIVE

    def state(self, condition, what):
        w = self.world
        w.wait(lambda: condition(w.last("robot/state")), what)

    def test_a_grasp_brings_the_package_to_the_tray(self):
        self.start_task()
        del self.world.suction[:]
        self.decide(Decision.GRASP)
        self.state(lambda s: s.current == Decision.GRASP, "the grasp in robot/state")
        self.drive(11)
        self.assertEqual(self.world.suction, [True, False])
        self.state(lambda s: s.current == Decision.IDLE and s.phase == s.PHASE_REST, "rest at home")
        numbers = [handle.get_goal().number for handle in self.world.goals]
        self.assertEqual(numbers, list(range(1, len(numbers) + 1)))

    def test_a_warning_holds_and_cancel_withdraws(self):
        self.start_task()
        self.decide(Decision.PLANNING)
        self.active()
        goal = self.world.goals[-1]
        self.world.say("motion", "human/warning", Header())
        self.until(lambda: goal.get_goal_status().status == actionlib.GoalStatus.PREEMPTED)
        self.until(lambda: self.world.last("safety/state").state == SafetyState.SLOW)
        self.decide(Decision.CANCEL)
        self.until(lambda: self.world.goals[-1] is not goal)
        self.assertAlmostEqual(self.world.goals[-1].get_goal().pose.position.x, 0.197)
        self.reach()

    def test_a_stop_latches_until_the_release(self):
        self.start_task()
        self.decide(Decision.PLANNING)
        self.active()
        goal = self.world.goals[-1]
        self.assertTrue(rospy.ServiceProxy("safety/stop", Stop)("a test").accepted)
        self.until(lambda: goal.get_goal_status().status == actionlib.GoalStatus.PREEMPTED)
        self.until(lambda: self.world.last("safety/state").state == SafetyState.STOP)
        self.assertEqual(self.world.last("safety/state").cause, "a test")
        self.decide(Decision.GRASP)
        self.assertIs(self.world.goals[-1], goal)
        release = rospy.ServiceProxy("safety/release", Command)
        self.assertTrue(release().accepted)
        self.assertFalse(release().accepted)
        self.decide(Decision.IDLE)
        self.assertTrue(self.active())
        self.drive(1)

    def test_an_action_is_executed_and_its_end_told(self):
        self.start_task()
        client = actionlib.SimpleActionClient("robot/execute", ExecuteRobotActionAction)
        self.assertTrue(client.wait_for_server(rospy.Duration(DEADLINE)))
        goals = len(self.world.goals)
        client.send_goal(ExecuteRobotActionGoal(action=Decision.POINT))
        self.world.wait(lambda: len(self.world.goals) > goals, "the gesture")
        self.drive(5)
        self.assertTrue(client.wait_for_result(rospy.Duration(DEADLINE)))
        self.assertEqual(client.get_result().outcome, ExecuteRobotActionResult.DONE)
        client.send_goal(ExecuteRobotActionGoal(action=77))
        self.assertTrue(client.wait_for_result(rospy.Duration(DEADLINE)))
        self.assertEqual(client.get_result().outcome, ExecuteRobotActionResult.REFUSED)

    def test_a_gesture_is_played_and_a_cancel_beats_it(self):
        self.start_task()
        client = actionlib.SimpleActionClient("robot/execute", ExecuteRobotActionAction)
        self.assertTrue(client.wait_for_server(rospy.Duration(DEADLINE)))
        goals = len(self.world.goals)
        client.send_goal(ExecuteRobotActionGoal(gesture="pointing_2"))
        self.world.wait(lambda: len(self.world.goals) > goals, "the gesture")
        gesture = self.world.goals[-1]
        self.assertAlmostEqual(gesture.get_goal().pose.position.z, 0.120)
        self.decide(Decision.CANCEL)
        self.until(lambda: self.world.goals[-1] is not gesture)
        self.assertTrue(client.wait_for_result(rospy.Duration(DEADLINE)))
        self.assertEqual(client.get_result().outcome, ExecuteRobotActionResult.PRE_EMPTED)
        self.drive(1)
        client.send_goal(ExecuteRobotActionGoal(gesture="wave"))
        self.assertTrue(client.wait_for_result(rospy.Duration(DEADLINE)))
        self.assertEqual(client.get_result().outcome, ExecuteRobotActionResult.REFUSED)
        self.assertIn("no gesture 'wave'", client.get_result().reason)

    def test_without_a_tracked_hand_no_distance_is_told(self):
        self.until(lambda: self.world.last("safety/state"))
        self.assertTrue(math.isnan(self.world.last("safety/state").separation))

    def test_robot_state_repeats_without_counting(self):
        seen = len(self.world.heard["robot/state"])
        w = self.world
        w.wait(lambda: len(w.heard["robot/state"]) > seen + 3, "repeats")
        states = w.heard["robot/state"]
        self.assertEqual(states[-1].sequence, states[seen + 1].sequence)
        sent = {e.topic: e.count for e in self.beat("motion").sent}
        self.assertEqual(sent["robot/state"], states[-1].sequence)


if __name__ == "__main__":
    rospy.init_node("planner_nodes")
    NodesTest.world = World()
    rostest.rosrun("fabric_tests", "planner_nodes", NodesTest, sys.argv)
