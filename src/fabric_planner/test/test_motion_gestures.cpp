// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "fabric_planner/pomdp.hpp"
#include "motion_bench.hpp"

namespace fabric::planner::test {
namespace {

using A = Action;

TEST(Gesture, EachOneOfTheFileIsPlayedToItsEnd) {
  for (const auto& [name, gesture] : MotionConfig::load(MOTION_YAML).gestures) {
    MotionBench bench = MotionBench::ready();
    bench.play(name);
    EXPECT_EQ(bench.agent.state().current, gesture.action) << name;
    bench.finish();
    EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE) << name;
    const WayPoint& last = gesture.steps.back().way_point;
    EXPECT_EQ(bench.tool, bench.places.poses.at(last.place)) << name;
    EXPECT_FALSE(bench.suction) << name;
  }
}

TEST(Gesture, GoesThroughItsWayPointsWithTheirSpeedsAndHolds) {
  MotionBench bench = MotionBench::ready();
  bench.play("pointing_2");
  EXPECT_EQ(bench.outstanding->pose, bench.places.poses.at("half_up"));
  EXPECT_DOUBLE_EQ(bench.outstanding->speed, 0.16);
  EXPECT_DOUBLE_EQ(bench.outstanding->settle, 0.5);
  bench.step();
  bench.step();
  const ToolPose point = bench.places.poses.at("point");
  EXPECT_EQ(bench.outstanding->pose, point.at(point.z - 0.045));
  EXPECT_DOUBLE_EQ(bench.outstanding->speed, 0.12);
  EXPECT_DOUBLE_EQ(bench.outstanding->settle, 0.0);
}

TEST(Gesture, ThatPlansLeavesTheGraspPlanned) {
  MotionBench bench = MotionBench::ready();
  bench.play("planning_1");
  bench.finish();
  EXPECT_TRUE(bench.agent.state().planned);
  bench.decide(A::GRASP);
  EXPECT_EQ(bench.outstanding->pose, bench.places.pick().at(bench.places.above_pick));
}

TEST(Gesture, IsDisplacedByCancelAtOnce) {
  for (const auto& [name, gesture] : MotionConfig::load(MOTION_YAML).gestures) {
    if (gesture.action == A::CANCEL || name == "idle") continue;
    MotionBench bench = MotionBench::ready();
    bench.play(name);
    bench.decide(A::CANCEL);
    EXPECT_TRUE(bench.cancelled) << name;
    EXPECT_EQ(bench.agent.state().current, A::CANCEL) << name;
    EXPECT_EQ(bench.lastEnd(), ActionOutcome::PRE_EMPTED) << name;
  }
}

TEST(Gesture, WaitsForAnotherOneOfItsAction) {
  MotionBench bench = MotionBench::ready();
  bench.play("pointing_1");
  bench.play("pointing_1");
  EXPECT_FALSE(bench.agent.state().queued) << "the same one is under way";
  bench.decide(A::POINT);
  EXPECT_FALSE(bench.agent.state().queued) << "any will do";
  bench.play("pointing_2");
  EXPECT_EQ(bench.agent.state().queued, A::POINT);
  bench.until(bench.places.poses.at("half_up"));
}

TEST(Gesture, ThatIsAskedForByItsNameIsPlayedThoughItIsPlanned) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.finish();
  bench.play("planning_2");
  ASSERT_TRUE(bench.outstanding);
  EXPECT_EQ(bench.outstanding->pose, bench.places.poses.at("beside_belt"));
}

TEST(Gesture, WithoutACubeAGraspSaysSo) {
  MotionBench bench = MotionBench::ready();
  bench.cube(false);
  bench.play("grasp");
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::NOTHING_TO_GRASP);
}

TEST(Gesture, OfAnUnknownNameIsRefused) {
  MotionBench bench = MotionBench::ready();
  EXPECT_THROW(bench.agent.onGesture("wave"), ModelError);
  EXPECT_FALSE(bench.outstanding);
}

// -- a cube lost on the way ----------------------------------------------------------------------

/// On the way to the tray, with the cube seen at the cup.
MotionBench carrying() {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.side());
  bench.seeAtCup(true);
  bench.agent.takeEnds();
  return bench;
}

TEST(LostCube, IsNoticedAfterSomeViewsWithoutItAndEndsTheGrasp) {
  MotionBench bench = carrying();
  for (int view = 1; view < bench.places.lost_after; ++view) bench.seeAtCup(false);
  EXPECT_TRUE(bench.agent.state().holding);
  bench.seeAtCup(false);
  EXPECT_FALSE(bench.agent.state().holding);
  EXPECT_TRUE(bench.agent.state().lost);
  EXPECT_EQ(bench.agent.state().phase, Phase::RETREAT);
  EXPECT_TRUE(bench.cancelled);
  EXPECT_FALSE(bench.suction);
  bench.step();
  EXPECT_EQ(bench.outstanding->pose, bench.places.home());
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::CUBE_LOST);
}

TEST(LostCube, BeyondTheBeltTheArmComesBackByTheSide) {
  MotionBench bench = carrying();
  const ToolPose tray = bench.places.trays.at("red");
  bench.until(tray);
  for (int view = 0; view < bench.places.lost_after; ++view) bench.seeAtCup(false);
  bench.log.clear();
  bench.finish();
  EXPECT_EQ(bench.path(), (std::vector{tray.at(bench.places.above_tray), bench.places.side(),
                                       bench.places.home()}));
}

TEST(LostCube, DoesNotFillASlotAndTheNextGraspBeginsAnew) {
  MotionBench bench = carrying();
  for (int view = 0; view < bench.places.lost_after; ++view) bench.seeAtCup(false);
  bench.finish();
  bench.cube(true);
  bench.decide(A::GRASP);
  EXPECT_FALSE(bench.agent.state().lost);
  bench.until(bench.places.slot("red", 0));
}

TEST(LostCube, IsNotOneThatACameraMissesForAMoment) {
  MotionBench bench = carrying();
  for (int round = 0; round < 5; ++round) {
    for (int view = 1; view < bench.places.lost_after; ++view) bench.seeAtCup(false);
    bench.seeAtCup(true);
  }
  EXPECT_TRUE(bench.agent.state().holding);
  bench.until(bench.places.trays.at("red"));
}

TEST(LostCube, IsNotOneThatWasNeverSeenAtTheCup) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  bench.until(bench.places.side());
  for (int view = 0; view < 10; ++view) bench.seeAtCup(false);
  EXPECT_TRUE(bench.agent.state().holding);
}

TEST(LostCube, OnTheWayBackLeavesNothingToPutBack) {
  MotionBench bench = carrying();
  bench.decide(A::CANCEL);
  bench.step();
  for (int view = 0; view < bench.places.lost_after; ++view) bench.seeAtCup(false);
  EXPECT_FALSE(bench.suction);
  bench.log.clear();
  bench.finish();
  EXPECT_EQ(bench.path(), std::vector{bench.places.home()});
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE);
}

TEST(LostCube, WhileStoppedIsToldAndTheSuctionStays) {
  MotionBench bench = carrying();
  bench.apply(bench.agent.onStop("button"));
  for (int view = 0; view < bench.places.lost_after; ++view) bench.seeAtCup(false);
  EXPECT_TRUE(bench.agent.state().lost);
  EXPECT_TRUE(bench.suction);
}

}  // namespace
}  // namespace fabric::planner::test
