// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "fabric_planner/examples/tiger.hpp"
#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/pomcp.hpp"
#include "fabric_planner/pomdpx.hpp"
#include "fabric_planner/tabular_model.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using examples::Tiger;

constexpr double AMPLE = 1e6;  // s: a deadline that never ends a search

PomcpOptions limited(int simulations, double exploration = -1.0) {
  PomcpOptions options;
  options.deadline = AMPLE;
  options.max_simulations = simulations;
  options.exploration = exploration;
  return options;
}

/// A belief that stays where it is: the tiger is left with probability p.
class FixedTiger final : public Belief<Tiger::State> {
 public:
  explicit FixedTiger(double p) : p_(p) {}
  void reset(std::uint64_t /*seed*/) override {}
  UpdateStatus update(int /*action*/, Observation /*observation*/) override {
    return UpdateStatus::OK;
  }
  void sample(Random& random, int count, Tiger::State* out) const override {
    for (int i = 0; i < count; ++i) out[i] = random.uniform() < p_ ? Tiger::LEFT : Tiger::RIGHT;
  }
  std::uint64_t recoveries() const override { return 0; }

 private:
  double p_;
};

TEST(Pomcp, TakesTheExactPlannersActionOnTiger) {
  const auto pomdp = std::make_shared<Pomdp>(loadPomdpx(PACKAGE_DIR "/test/models/tiger.pomdpx"));
  OnlinePlanner exact(pomdp, {AMPLE, 0.5, 5000});
  const Tiger model;
  PomcpOptions options = limited(30000, 60.0);
  options.rollout = Rollout::DEFAULT_ACTION;
  options.max_depth = 30;
  Pomcp<Tiger> planner(model, options);
  for (const double p : {0.5, 0.15, 0.001, 0.999, 0.85}) {
    EXPECT_EQ(planner.decide(FixedTiger(p)).action,
              exact.decide(Eigen::Vector2d(p, 1.0 - p)).action)
        << "P(left) = " << p;
  }
}

TEST(Pomcp, FindsTheValueWorkedOutByHand) {
  for (const double p : {0.3, 0.8, 0.95}) {
    const TabularModel model(testing::takeLeaveLook(p));
    Pomcp<TabularModel> planner(model, limited(30000, 1.0));
    const Decision decision = planner.decide(*model.makeBelief(1));
    EXPECT_NEAR(decision.value, std::max({0.0, 3.0 * p - 2.0, -0.1 + 0.9 * p}), 0.03);
    EXPECT_EQ(decision.action, p == 0.95 ? 0 : 2);
  }
}

TEST(Pomcp, ItsValueNeverPretendsToBeABound) {
  const Tiger model;
  Pomcp<Tiger> planner(model, limited(100));
  const Decision decision = planner.decide(FixedTiger(0.5));
  EXPECT_EQ(decision.lower_bound, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(decision.upper_bound, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isfinite(decision.value));
  EXPECT_GE(decision.runner_up_gap, 0.0);
}

TEST(Pomcp, TheSameSeedRepeatsEveryDecision) {
  const Tiger model;
  Pomcp<Tiger> one(model, limited(500));
  Pomcp<Tiger> other(model, limited(500));
  for (int i = 0; i < 3; ++i) {
    const Decision a = one.decide(FixedTiger(0.4));
    const Decision b = other.decide(FixedTiger(0.4));
    EXPECT_EQ(a.value, b.value);
    EXPECT_EQ(a.nodes, b.nodes);
    one.advance(a.action, 0);
    other.advance(a.action, 0);
  }
  one.reset(2);
  other.reset(3);
  EXPECT_NE(one.decide(FixedTiger(0.4)).value, other.decide(FixedTiger(0.4)).value);
}

TEST(Pomcp, AdvanceKeepsTheTreeAndDecideAloneDoesNot) {
  const Tiger model;
  Pomcp<Tiger> planner(model, limited(1000));
  planner.decide(FixedTiger(0.5));
  planner.advance(Tiger::LISTEN, Tiger::LEFT);
  EXPECT_GT(planner.decide(FixedTiger(0.85)).nodes, 1500);
  EXPECT_LE(planner.decide(FixedTiger(0.85)).nodes, 1001);
  planner.advance(Tiger::LISTEN, 77);  // never seen: nothing to keep
  EXPECT_LE(planner.decide(FixedTiger(0.85)).nodes, 1001);
}

TEST(Pomcp, StaysWithinItsMemory) {
  const Tiger model;
  PomcpOptions options = limited(20000);
  options.memory = 64 * 1024;
  Pomcp<Tiger> planner(model, options);
  EXPECT_LE(planner.memory(), options.memory);
  const int nodes = planner.decide(FixedTiger(0.5)).nodes;
  EXPECT_LT(nodes, 2000);
  EXPECT_EQ(planner.decide(FixedTiger(0.5)).trials, 20000);
  for (int i = 0; i < 20; ++i) {
    planner.advance(Tiger::LISTEN, Tiger::LEFT);
    EXPECT_LE(planner.decide(FixedTiger(0.5)).nodes, nodes);
  }
}

TEST(Pomcp, WithoutTimeTheRolloutPolicyAnswers) {
  const Tiger model;
  PomcpOptions options;
  options.deadline = 0.0;
  options.rollout = Rollout::DEFAULT_ACTION;
  Pomcp<Tiger> planner(model, options);
  const Decision decision = planner.decide(FixedTiger(0.5));
  EXPECT_TRUE(decision.fallback_used);
  EXPECT_EQ(decision.action, Tiger::LISTEN);
  EXPECT_EQ(decision.ended_by, EndedBy::DEADLINE);
}

/// Tiger whose left door is nailed up.
struct NailedTiger : Tiger {
  [[nodiscard]] bool legal(const State& /*state*/, int action) const { return action != OPEN_LEFT; }
  [[nodiscard]] Step step(State& state, int action, double u) const {
    if (action == OPEN_LEFT) throw std::logic_error("an illegal action was simulated");
    return Tiger::step(state, action, u);
  }
};

TEST(Pomcp, NeverTakesAnIllegalAction) {
  const NailedTiger model;
  Pomcp<NailedTiger> planner(model, limited(2000));
  std::set<int> taken;
  for (const double p : {0.01, 0.5, 0.99}) taken.insert(planner.decide(FixedTiger(p)).action);
  EXPECT_EQ(taken.count(Tiger::OPEN_LEFT), 0U);
}

TEST(Pomcp, ForgetsNothingOfItsTreeWhenAModelThrows) {
  struct Trap : Tiger {
    mutable int left = 500;
    Step step(State& state, int action, double u) const {
      if (--left == 0) throw std::runtime_error("the model broke");
      return Tiger::step(state, action, u);
    }
  };
  const Trap model;
  Pomcp<Trap> planner(model, limited(100));
  EXPECT_THROW(planner.decide(FixedTiger(0.5)), std::runtime_error);
  EXPECT_EQ(planner.decide(FixedTiger(0.5)).trials, 100);
}

TEST(Pomcp, RefusesOptionsOutOfRangeByName) {
  const Tiger model;
  const auto refusal = [&](auto change) {
    PomcpOptions options;
    change(options);
    return testing::refusal([&] { Pomcp<Tiger>(model, options); });
  };
  EXPECT_NE(refusal([](auto& o) { o.deadline = std::nan(""); }).find("deadline is nan"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.max_depth = 0; }).find("max_depth is 0"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.max_simulations = -1; }).find("max_simulations is -1"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.exploration = INFINITY; }).find("exploration is inf"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.memory = 100; }).find("memory is 100 bytes"),
            std::string::npos);
  Pomcp<Tiger> planner(model);
  EXPECT_THROW(planner.advance(3, 0), std::out_of_range);
}

}  // namespace
}  // namespace fabric::planner
