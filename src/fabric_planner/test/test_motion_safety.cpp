// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "motion_bench.hpp"

namespace fabric::planner::test {
namespace {

using A = Action;

TEST(HandNear, BreaksOffAFastMoveAndGoesOnSlowly) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::POINT);
  const MotionCommand fast = *bench.outstanding;
  bench.separate(Separation::SLOW);
  EXPECT_TRUE(bench.cancelled);
  bench.step();
  ASSERT_TRUE(bench.outstanding);
  EXPECT_EQ(bench.outstanding->pose, fast.pose) << "the same way-point";
  EXPECT_DOUBLE_EQ(bench.outstanding->speed, SLOW_FACTOR * fast.speed);
}

TEST(HandNear, DoesNotBreakOffASlowMoveAgain) {
  MotionBench bench = MotionBench::ready();
  bench.separate(Separation::SLOW);
  bench.decide(A::POINT);
  bench.separate(Separation::SLOW);
  EXPECT_FALSE(bench.cancelled);
}

TEST(HandNear, GoneAgainLetsTheNextMoveBeFast) {
  MotionBench bench = MotionBench::ready();
  bench.separate(Separation::SLOW);
  bench.decide(A::POINT);
  bench.separate(Separation::RUN);
  EXPECT_FALSE(bench.cancelled) << "no jerk";
  bench.step();
  EXPECT_DOUBLE_EQ(bench.outstanding->speed, bench.places.speeds.at("gesture"));
}

TEST(HandTooNear, StopsAtOnceAndGoesOnByItselfWhenTheHandHasGone) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::GRASP);
  const ToolPose goal = bench.outstanding->pose;
  bench.separate(Separation::STOP);
  EXPECT_TRUE(bench.cancelled);
  bench.step();
  EXPECT_FALSE(bench.outstanding);
  EXPECT_EQ(bench.agent.state().current, A::GRASP);
  bench.separate(Separation::SLOW);
  ASSERT_TRUE(bench.outstanding);
  EXPECT_EQ(bench.outstanding->pose, goal);
  EXPECT_DOUBLE_EQ(bench.outstanding->speed, SLOW_FACTOR * bench.places.travelSpeed());
  bench.separate(Separation::RUN);
  bench.finish();
  EXPECT_EQ(bench.lastEnd(), ActionOutcome::DONE);
}

TEST(HandTooNear, DecisionsAreArbitratedAndMoveNothing) {
  MotionBench bench = MotionBench::ready();
  bench.separate(Separation::STOP);
  bench.decide(A::PLANNING);
  bench.decide(A::CANCEL);
  EXPECT_FALSE(bench.outstanding);
  EXPECT_EQ(bench.agent.state().pre_empted, A::PLANNING);
  bench.separate(Separation::RUN);
  bench.decide(A::PLANNING);
  bench.finish();
  EXPECT_EQ(bench.agent.state().current, A::PLANNING);
}

TEST(HandTooNear, DoesNotEndAStopThatLatches) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.apply(bench.agent.onStop("button"));
  bench.step();
  bench.separate(Separation::STOP);
  bench.separate(Separation::RUN);
  bench.decide(A::IDLE);
  EXPECT_FALSE(bench.outstanding);
  bench.apply(bench.agent.onRelease());
  bench.decide(A::IDLE);
  EXPECT_TRUE(bench.outstanding);
}

TEST(HandTooNear, GoneAgainDoesNotEndAWarning) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  bench.apply(bench.agent.onWarning());
  bench.separate(Separation::STOP);
  bench.step();
  bench.separate(Separation::RUN);
  EXPECT_FALSE(bench.outstanding);
  bench.decide(A::PLANNING);
  EXPECT_TRUE(bench.outstanding);
}

TEST(HandTooNear, DoesNotBreakOffWhatOnlyWaitsAtItsGoal) {
  MotionBench bench = MotionBench::ready();
  bench.decide(A::PLANNING);
  const ToolPose goal = bench.outstanding->pose;
  bench.agent.onTool({goal.x, goal.y, goal.z + 0.0005, 0.0});
  bench.separate(Separation::STOP);
  EXPECT_FALSE(bench.cancelled) << "it stands there and plans";
  bench.decide(A::POINT);
  bench.step();
  EXPECT_FALSE(bench.outstanding) << "the gesture has to wait";
  bench.separate(Separation::RUN);
  EXPECT_EQ(bench.outstanding->pose, bench.places.poses.at("attention"));
}

}  // namespace
}  // namespace fabric::planner::test
