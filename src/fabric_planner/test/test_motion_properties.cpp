// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "motion_bench.hpp"

namespace fabric::planner::test {
namespace {

/// One random event. The bench checks after each that at most one move is outstanding and that
/// nothing moves while stopped or held.
void disturb(MotionBench& bench, std::mt19937& random) {
  const auto pick = [&random](int n) { return std::uniform_int_distribution<>(0, n - 1)(random); };
  switch (pick(12)) {
    case 0:
    case 1:
    case 2:
      return bench.decide(ALL_ACTIONS[pick(5)]);
    case 3:
      return bench.cube(pick(4) > 0);
    case 4:
      return bench.apply(bench.agent.onWarning());
    case 5:
      if (pick(4) == 0) bench.apply(bench.agent.onStop("random"));
      return;
    case 6:
      return bench.apply(bench.agent.onRelease());
    case 7:
      if (pick(4) == 0) bench.apply(bench.agent.onTask(sortingTask(1 + pick(3), pick(6))));
      return;
    case 8:
      if (pick(4) == 0) bench.apply(bench.agent.onSuctionFailure("random"));
      return;
    case 9:
      if (bench.outstanding) bench.arm(static_cast<ArmOutcome>(pick(5)));
      return;
    default:
      if (bench.outstanding) bench.step();
  }
}

/// Whatever happened, after a release the robot can be sent home with nothing at the cup.
void expectRecovers(MotionBench& bench) {
  bench.apply(bench.agent.onRelease());
  bench.apply(bench.agent.onTask(sortingTask(99, RUNNING)));
  bench.finish();
  bench.decide(Action::CANCEL);
  bench.finish();
  EXPECT_EQ(bench.tool, bench.places.home);
  EXPECT_FALSE(bench.suction);
  EXPECT_FALSE(bench.agent.state().holding);
}

TEST(MotionProperties, NoSequenceOfEventsYieldsTwoMovesOrMotionWhileStopped) {
  for (unsigned seed = 1; seed <= 400; ++seed) {
    std::mt19937 random(seed);
    MotionBench bench;
    for (int event = 0; event < 150 && !testing::Test::HasFailure(); ++event) {
      disturb(bench, random);
      ASSERT_EQ(bench.agent.outstanding().has_value(), bench.outstanding.has_value());
    }
    expectRecovers(bench);
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
}

TEST(MotionProperties, TheSameEventsGiveTheSameCommands) {
  const auto run = [](unsigned seed) {
    std::mt19937 random(seed);
    MotionBench bench;
    for (int event = 0; event < 300; ++event) disturb(bench, random);
    return bench.path();
  };
  EXPECT_EQ(run(7), run(7));
}

TEST(MotionProperties, EveryRequestEndsExactlyOnce) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    std::mt19937 random(seed);
    MotionBench bench;
    for (int event = 0; event < 150; ++event) disturb(bench, random);
    expectRecovers(bench);
    std::map<std::uint64_t, int> ended;
    for (const ActionEnd& end : bench.agent.takeEnds()) ++ended[end.ticket];
    for (const auto& [ticket, times] : ended) EXPECT_EQ(times, 1) << "ticket " << ticket;
    EXPECT_EQ(ended.size(), bench.agent.ticket()) << "seed " << seed;
  }
}

}  // namespace
}  // namespace fabric::planner::test
