// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "fabric_planner/arbiter.hpp"
#include "motion_bench.hpp"

namespace fabric::planner::test {
namespace {

const std::vector<std::string> GESTURES = {"idle",       "planning_1", "planning_2", "pointing_1",
                                           "pointing_2", "grasp",      "cancel"};

/// One random event. The bench checks after each that at most one move is outstanding and that
/// nothing moves while stopped, held or with a hand too close.
void disturb(MotionBench& bench, std::mt19937& random) {
  const auto pick = [&random](int n) { return std::uniform_int_distribution<>(0, n - 1)(random); };
  switch (pick(15)) {
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
    case 10:
      return bench.play(GESTURES[pick(7)]);
    case 11:
      return bench.seeAtCup(pick(3) > 0);
    case 12:
      return bench.separate(static_cast<Separation>(pick(4) % 3));
    default:
      if (bench.outstanding) bench.step();
  }
}

/// Whatever happened, after a release the robot can be sent home with nothing at the cup.
void expectRecovers(MotionBench& bench) {
  bench.apply(bench.agent.onRelease());
  bench.separate(Separation::RUN);
  bench.apply(bench.agent.onTask(sortingTask(99, RUNNING)));
  bench.finish();
  bench.decide(Action::CANCEL);
  bench.finish();
  EXPECT_EQ(bench.tool, bench.places.home());
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

// -- Table 6.5 under long sequences of decisions -------------------------------------------------

/// Which pre-emptions Table 6.5 allows, read off the thesis' words and not off the arbiter.
bool mayPreEmpt(Action running, Action next) {
  if (next == Action::CANCEL) return running != Action::CANCEL;  // "all other actions"
  return next == Action::GRASP && running == Action::IDLE;       // the others block or come first
}

/// A robot that decides 10,000 times, at random, at any moment of its moves.
class Decided {
 public:
  explicit Decided(unsigned seed)
      : bench_(MotionBench::ready()), random_(seed), first_(bench_.agent.ticket()) {}

  void run(int length) {
    for (int i = 0; i < length && !testing::Test::HasFailure(); ++i) {
      decide(ALL_ACTIONS[pick(5)]);
      for (int moves = pick(4); moves > 0; --moves) progress();
    }
    bench_.finish();
    expectNothingLost();
  }

  [[nodiscard]] std::size_t preEmptions() const { return pre_emptions_; }

 private:
  int pick(int n) { return std::uniform_int_distribution<>(0, n - 1)(random_); }

  void decide(Action action) {
    const auto before = running();
    bench_.decide(action);
    takeEnds();
    const RobotState& state = bench_.agent.state();
    if (before && state.pre_empted && displaced_) {
      EXPECT_TRUE(mayPreEmpt(*before, action))
          << actionName(action) << " displaced " << actionName(*before);
      ++pre_emptions_;
    }
    if (action == Action::CANCEL) {
      // in the very step: it runs, or had nothing to do, and no other move goes on
      EXPECT_TRUE(state.current == Action::CANCEL || state.current == Action::IDLE);
      EXPECT_FALSE(state.queued);
      if (before && *before != Action::CANCEL) {
        EXPECT_TRUE(bench_.cancelled);
      }
    }
  }

  void progress() {
    if (pick(5) == 0) bench_.cube(pick(4) > 0);
    if (bench_.outstanding) bench_.step();
    takeEnds();
  }

  /// What the arbiter sees: a grasp whose cube is placed or gone only drives home, which is idle.
  [[nodiscard]] std::optional<Action> running() const {
    const RobotState& state = bench_.agent.state();
    const bool let_go = state.phase == Phase::CONTACT && !bench_.suction;
    const bool withdraws =
        state.current == Action::GRASP && (state.phase == Phase::RETREAT || let_go);
    if (!bench_.outstanding) return std::nullopt;
    return withdraws ? Action::IDLE : state.current;
  }

  void takeEnds() {
    displaced_ = false;
    for (const ActionEnd& end : bench_.agent.takeEnds()) {
      EXPECT_TRUE(ended_.insert(end.ticket).second) << "ended twice: " << end.ticket;
      displaced_ |= end.reason.find("displaced") == 0;
      if (end.outcome == ActionOutcome::PRE_EMPTED) {
        EXPECT_TRUE(end.reason == "a newer decision came" || end.reason.find("displaced") == 0)
            << end.reason;
      }
    }
  }

  /// Every decision was carried out, gave way as the table says, or to a newer one while it waited.
  void expectNothingLost() {
    takeEnds();
    EXPECT_EQ(ended_.size(), bench_.agent.ticket() - first_);
    EXPECT_FALSE(bench_.agent.state().queued);
  }

  MotionBench bench_;
  std::mt19937 random_;
  std::uint64_t first_;  // ticket before the first decision
  std::set<std::uint64_t> ended_;
  std::size_t pre_emptions_ = 0;
  bool displaced_ = false;  // by the newest decision
};

TEST(MotionProperties, TenThousandDecisionsPreEmptAsTable65SaysAndNoneIsLost) {
  for (const unsigned seed : {101U, 102U, 103U, 104U, 105U}) {
    Decided robot(seed);
    robot.run(10000);
    EXPECT_GT(robot.preEmptions(), 500U) << "seed " << seed;
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
}

TEST(MotionProperties, CancelComesWithinOneStepWhateverHappensBefore) {
  for (unsigned seed = 101; seed < 111; ++seed) {
    std::mt19937 random(seed);
    MotionBench bench;
    for (int event = 0; event < 1000; ++event) {
      disturb(bench, random);
      if (bench.agent.stopped()) continue;
      const auto under_way = bench.outstanding;
      const bool cancelling = bench.agent.state().current == Action::CANCEL;
      bench.decide(Action::CANCEL);
      const RobotState& state = bench.agent.state();
      ASSERT_TRUE(state.current == Action::CANCEL || state.current == Action::IDLE);
      ASSERT_FALSE(state.queued);
      if (under_way && !cancelling) {
        ASSERT_TRUE(bench.cancelled);
      }
    }
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
}

}  // namespace
}  // namespace fabric::planner::test
