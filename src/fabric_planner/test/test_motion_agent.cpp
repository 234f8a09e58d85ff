// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "motion_bench.hpp"

namespace fabric::planner::test {
namespace {

using A = Action;
using Kind = MotionCommand::Kind;

std::vector<Kind> kinds(const MotionBench& bench) {
  std::vector<Kind> result;
  for (const MotionCommand& command : bench.log) result.push_back(command.kind);
  return result;
}

TEST(Idle, DrivesHomeOnceAndRestsThere) {
  MotionBench bench;
  bench.decide(A::IDLE);
  EXPECT_EQ(bench.path(), std::vector{bench.places.home()});
  bench.finish();
  EXPECT_EQ(bench.agent.state().phase, Phase::REST);
  bench.decide(A::IDLE);
  EXPECT_EQ(bench.path().size(), 1U);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE);
}

TEST(Planning, StandsAtItsPoseLongEnoughAndIsThenPlanned) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  ASSERT_EQ(bench.path(), std::vector{bench.places.poses.at("beside_belt")});
  EXPECT_DOUBLE_EQ(bench.outstanding->settle, 3.4);
  EXPECT_FALSE(bench.agent.state().planned);
  bench.finish();
  EXPECT_TRUE(bench.agent.state().planned);
  EXPECT_EQ(bench.agent.state().current, A::PLANNING);
  bench.decide(A::PLANNING);
  EXPECT_EQ(bench.path().size(), 1U) << "what is planned is not planned again";
}

TEST(Planning, IsWorthNothingWithoutACube) {
  MotionBench bench = MotionBench::ready();
  bench.cube(false);
  bench.decide(A::PLANNING);
  bench.finish();
  EXPECT_FALSE(bench.agent.state().planned);
}

TEST(Planning, IsForgottenWhenTheCubeGoes) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.finish();
  bench.cube(false);
  EXPECT_FALSE(bench.agent.state().planned);
}

TEST(Point, RearsUpNodsAtTheCubeAndGoesHome) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::POINT);
  bench.finish();
  const MotionConfig& c = bench.places;
  const ToolPose down = c.poses.at("point");
  const ToolPose low = down.at(down.z - 0.025);
  EXPECT_EQ(bench.path(), (std::vector{c.poses.at("attention"), down, low, down, low, c.home()}));
}

TEST(Grasp, PlansTakesTheCubePutsItIntoItsTrayAndGoesHome) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.finish();
  const MotionConfig& c = bench.places;
  const ToolPose above = c.pick().at(c.above_pick);
  const ToolPose tray = c.trays.at("red");
  const ToolPose over = tray.at(c.above_tray);
  EXPECT_EQ(bench.path(), (std::vector{c.poses.at("beside_belt"), above, c.pick(), c.pick(), above,
                                       c.side(), over, tray, tray, over, c.side(), c.home()}));
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE);
  EXPECT_FALSE(bench.agent.state().holding);
  EXPECT_FALSE(bench.agent.state().planned);
}

TEST(Grasp, StartsAtOnceWhenPlanned) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.finish();
  bench.decide(A::GRASP);
  const ToolPose above = bench.places.pick().at(bench.places.above_pick);
  EXPECT_EQ(bench.outstanding->pose, above);
}

TEST(Grasp, HoldsTheCubeOnlyBetweenLiftAndRelease) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.pick());
  EXPECT_FALSE(bench.agent.state().holding);
  bench.step();
  EXPECT_TRUE(bench.suction);
  EXPECT_EQ(bench.agent.state().phase, Phase::CONTACT);
  bench.step();
  EXPECT_TRUE(bench.agent.state().holding);
  EXPECT_EQ(bench.agent.state().phase, Phase::CARRY);
  bench.finish();
  EXPECT_FALSE(bench.suction);
}

TEST(Grasp, FillsTheSlotsOfATrayInTurn) {
  MotionBench bench = MotionBench::ready();
  for (unsigned count = 0; count < 2; ++count) {
    bench.cube(true);
    bench.decide(A::GRASP);
    bench.until(bench.places.slot("red", count));
    bench.finish();
  }
}

TEST(Grasp, TakesPackagesToTheInspectionTrayWhateverTheirColour) {
  MotionBench bench = MotionBench::ready();
  bench.apply(bench.agent.onTask({2, RUNNING, "inspection", {}}));
  bench.finish();
  bench.apply(bench.agent.onConveyor(true));
  bench.decide(A::GRASP);
  bench.until(bench.places.slot("inspected", 0));
}

TEST(Grasp, WithoutACubeGoesHomeAndSaysSo) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.finish();
  bench.cube(false);
  bench.decide(A::GRASP);
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
  EXPECT_EQ(bench.agent.state().phase, Phase::RETREAT);
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::NOTHING_TO_GRASP);
}

TEST(Grasp, OfAColourWithoutRuleIsRefused) {
  MotionBench bench = MotionBench::ready();
  bench.apply(bench.agent.onCubes({{SeenCube::COLOUR_UNKNOWN, SeenCube::WHERE_PICK_POINT, 0.9}}));
  bench.decide(A::GRASP);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::REFUSED);
}

TEST(Grasp, IsAbortedWhenTheCubeIsTakenAwayBeforeContact) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.pick());
  bench.cube(false);
  EXPECT_TRUE(bench.cancelled);
  bench.step();
  const ToolPose above = bench.places.pick().at(bench.places.above_pick);
  EXPECT_EQ(bench.outstanding->pose, above) << "up first";
  bench.step();
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::NOTHING_TO_GRASP);
  EXPECT_FALSE(bench.suction);
}

TEST(Grasp, NoticesACubeThatWasTakenUnderTheCup) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.pick());
  bench.step();
  ASSERT_TRUE(bench.suction);
  bench.cube(false);
  EXPECT_FALSE(bench.cancelled) << "with the suction on, the sensor decides at the lift";
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::NOTHING_TO_GRASP);
  EXPECT_FALSE(bench.suction);
}

TEST(Grasp, TrustsTheCameraThatSeesTheCubeAtTheCup) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.pick());
  bench.step();
  bench.cube(false);
  bench.apply(bench.agent.onCubes({{RED, SeenCube::WHERE_ROBOT, 0.9}}));
  bench.until(bench.places.trays.at("red"));
}

TEST(Grasp, NoticesACubeThatStaysBehindAtTheLift) {
  MotionBench bench = MotionBench::ready();
  bench.sticks = false;
  bench.decide(A::GRASP);
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::NOTHING_TO_GRASP);
  EXPECT_FALSE(bench.suction);
}

TEST(Cancel, StopsAtOnceAndGoesHome) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.decide(A::CANCEL);
  EXPECT_EQ(kinds(bench), (std::vector{Kind::MOVE, Kind::CANCEL}));
  bench.step();
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
  EXPECT_EQ(bench.agent.state().pre_empted, A::PLANNING);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::PRE_EMPTED);
}

TEST(Cancel, PutsAHeldCubeBackOnTheBelt) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  const ToolPose tray = bench.places.trays.at("red");
  bench.until(bench.places.pick());
  bench.until(tray);
  bench.log.clear();
  bench.decide(A::CANCEL);
  bench.finish();
  const MotionConfig& c = bench.places;
  const ToolPose above = c.dropBack().at(c.above_pick);
  EXPECT_EQ(bench.path(), (std::vector{tray.at(c.above_tray), c.side(), above, c.dropBack(),
                                       c.dropBack(), above, c.home()}));
  EXPECT_FALSE(bench.suction);
}

TEST(Cancel, LetsGoOfACubeThatIsNotLiftedYet) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.pick());
  bench.step();
  ASSERT_TRUE(bench.suction);
  bench.log.clear();
  bench.decide(A::CANCEL);
  bench.finish();
  const MotionConfig& c = bench.places;
  EXPECT_EQ(bench.path(), (std::vector{c.pick(), c.pick(), c.pick().at(c.above_pick), c.home()}));
  EXPECT_FALSE(bench.suction);
}

TEST(Queue, TheNewestDecisionWaitsForTheEnd) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::POINT);
  bench.decide(A::GRASP);
  bench.decide(A::PLANNING);
  EXPECT_EQ(bench.agent.state().queued, A::PLANNING);
  bench.until(bench.places.poses.at("beside_belt"));
  EXPECT_FALSE(bench.agent.state().queued);
  EXPECT_EQ(bench.agent.state().current, A::PLANNING);
}

TEST(Queue, IsClearedByADecisionForTheRunningAction) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.decide(A::IDLE);
  bench.decide(A::GRASP);
  EXPECT_FALSE(bench.agent.state().queued);
}

TEST(Queue, AGraspThatOnlyDrivesHomeGivesWayToTheNextGrasp) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.side());
  bench.step();
  bench.until(bench.places.side());  // on the way back
  bench.cube(true);
  bench.agent.takeEnds();
  bench.decide(A::GRASP);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE) << "the first cube is in its tray";
  bench.step();
  bench.until(bench.places.poses.at("beside_belt"));
}

TEST(Warning, HoldsTheArmAtOnceAndTheNextDecisionLetsItGoOn) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.apply(bench.agent.onWarning());
  EXPECT_TRUE(bench.cancelled);
  bench.step();
  EXPECT_FALSE(bench.outstanding);
  bench.decide(A::IDLE);
  ASSERT_TRUE(bench.outstanding);
  EXPECT_EQ(bench.outstanding->pose, bench.places.poses.at("beside_belt")) << "planning goes on";
  EXPECT_EQ(bench.agent.state().queued, A::IDLE);
}

TEST(Warning, FollowedByCancelRunsTheCancelScript) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.apply(bench.agent.onWarning());
  bench.decide(A::CANCEL);
  bench.step();
  EXPECT_EQ(bench.agent.state().current, A::CANCEL);
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
}

TEST(Stop, LatchesUntilReleasedAndADecisionIsMade) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.apply(bench.agent.onStop("button"));
  EXPECT_TRUE(bench.cancelled);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::STOPPED);
  bench.step();
  bench.decide(A::IDLE);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::REFUSED);
  EXPECT_FALSE(bench.outstanding);
  bench.apply(bench.agent.onRelease());
  EXPECT_FALSE(bench.outstanding) << "a release moves nothing";
  bench.decide(A::IDLE);
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
}

TEST(Stop, KeepsTheCubeAndTheNextActionPutsItBack) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.side());
  bench.apply(bench.agent.onStop("button"));
  bench.step();
  EXPECT_TRUE(bench.suction);
  bench.apply(bench.agent.onRelease());
  bench.decide(A::IDLE);
  bench.until(bench.places.dropBack());
  bench.finish();
  EXPECT_FALSE(bench.suction);
}

TEST(Arm, AFailureEndsTheActionAndTheQueue) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.decide(A::IDLE);
  bench.arm(ArmOutcome::UNREACHABLE);
  EXPECT_FALSE(bench.outstanding);
  EXPECT_FALSE(bench.agent.state().current);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::ARM_FAILED);
}

TEST(Arm, ResultsOfOtherMovesAreIgnored) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  EXPECT_TRUE(bench.agent.onArmResult(99, ArmOutcome::REACHED).empty());
  EXPECT_TRUE(bench.agent.outstanding());
}

TEST(Task, ANewOneBringsTheArmHome) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.decide(A::POINT);
  bench.apply(bench.agent.onTask(sortingTask(2, SHOWING_RULES)));
  EXPECT_FALSE(bench.agent.state().queued);
  bench.step();
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
}

TEST(Task, ThatIsOverAllowsOnlyToWithdraw) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.apply(bench.agent.onTask(sortingTask(1, TaskView::SUCCEEDED)));
  bench.finish();
  EXPECT_EQ(bench.tool, bench.places.home());
  bench.decide(A::GRASP);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::REFUSED);
  bench.decide(A::CANCEL);
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE);
}

TEST(Task, ADecisionForAnotherOneIsStale) {
  MotionBench bench = MotionBench::ready();
  bench.apply(bench.agent.onDecision(A::POINT, 7, 99));
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::REFUSED);
  EXPECT_FALSE(bench.outstanding);
}

TEST(State, CountsItsChanges) {
  MotionBench bench = MotionBench::ready();
  const std::uint32_t before = bench.agent.state().sequence;
  bench.apply(bench.agent.onConveyor(true));
  EXPECT_EQ(bench.agent.state().sequence, before);
  bench.decide(A::PLANNING);
  EXPECT_EQ(bench.agent.state().sequence, before + 1);
  EXPECT_EQ(bench.agent.state().decision_sequence, bench.decisions);
}

}  // namespace
}  // namespace fabric::planner::test
