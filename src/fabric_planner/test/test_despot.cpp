// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <tuple>

#include "fabric_planner/despot.hpp"
#include "fabric_planner/episodes.hpp"
#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/tabular_model.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::randomPomdp;
using testing::refusal;

/// Tiger (Kaelbling, Littman & Cassandra 1998): listen -1, right 0.85; open +10 or -100, and a
/// new tiger. Optimal value at the uniform belief, discount 0.95: 19.37.
std::shared_ptr<const Pomdp> tiger() {
  PomdpTables tables = testing::blankTables(2, 3, 2, 0.95);
  tables.actions = {"listen", "open_left", "open_right"};
  for (int a = 0; a < 3; ++a) {
    tables.T[static_cast<size_t>(a)].setConstant(0.5);
    tables.O[static_cast<size_t>(a)].setConstant(0.5);
  }
  tables.T[0].setIdentity();
  tables.O[0] << 0.85, 0.15, 0.15, 0.85;
  tables.R << -1.0, -1.0, -100.0, 10.0, 10.0, -100.0;
  tables.initial_belief << 0.5, 0.5;
  return std::make_shared<Pomdp>(tables);
}

DespotOptions unhurried(int scenarios, int nodes) {
  DespotOptions options;
  options.deadline = 1000.0;
  options.scenarios = scenarios;
  options.max_nodes = nodes;
  options.regularisation = 0.0;
  options.memory = std::size_t{64} << 20;
  return options;
}

/// Only what the concept requires. Action 1 is worth 1 a step, action 0 nothing.
struct BareModel {
  using State = std::uint8_t;
  [[nodiscard]] int numActions() const { return 2; }
  [[nodiscard]] double discount() const { return 0.9; }
  [[nodiscard]] std::vector<std::string> actionNames() const { return {"rest", "work"}; }
  [[nodiscard]] RewardRange rewardRange() const { return {0.0, 1.0}; }
  State initialState(Random& random) const { return static_cast<State>(random.below(2)); }
  Step step(State& state, int action, double u) const {
    state = u < 0.5 ? 0 : 1;
    return {static_cast<double>(action), state, false};
  }
};

/// Names the action -1 -- the state in its default policy; only the first action pays.
struct PolicyModel : BareModel {
  int defaultAction(const State* states, int count) const {
    return std::count(states, states + count, 1) * 2 > count ? 1 : 0;
  }
  Step step(State& state, int action, double u) const {
    const double reward = action == state ? 1.0 : 0.0;
    state = u < 0.5 ? 0 : 1;
    return {reward, state, false};
  }
};

/// b after the action and the observation, with the chance of the observation.
std::pair<Eigen::VectorXd, double> successor(const Pomdp& model, const Eigen::VectorXd& belief,
                                             int action, int observation) {
  const Eigen::VectorXd predicted = model.T(action).transpose() * belief;
  Eigen::VectorXd next = Eigen::VectorXd(model.O(action).col(observation)).cwiseProduct(predicted);
  const double chance = next.sum();
  if (chance > 0.0) next /= chance;
  return {next, chance};
}

/// (A,): what each action and the best behaviour after it are worth, from the exact planner.
std::vector<double> actionValues(const std::shared_ptr<const Pomdp>& model) {
  OnlinePlanner exact(model, {60.0, 1e-2, 20000});
  const Eigen::VectorXd& b = model->initialBelief();
  std::vector<double> values;
  for (int a = 0; a < model->numActions(); ++a) {
    double value = model->R().row(a).dot(b);
    for (int o = 0; o < model->numObservations(); ++o) {
      const auto [next, chance] = successor(*model, b, a, o);
      if (chance <= 0.0) continue;
      exact.reset();
      value += model->discount() * chance * exact.decide(next).lower_bound;
    }
    values.push_back(value);
  }
  return values;
}

void checkNode(const DespotNode& node) {
  ASSERT_LE(node.floor, node.lower);
  ASSERT_LE(node.lower, node.upper + 1e-9);
  for (int i = 0; i < node.num_edges; ++i) {
    const DespotEdge& edge = node.edges[i];
    if (!edge.simulated) continue;
    double lower = edge.reward;
    int scenarios = 0;
    for (int k = 0; k < edge.num_children; ++k) {
      lower += edge.children[k].lower;
      scenarios += edge.children[k].count;
      ASSERT_EQ(edge.children[k].depth, node.depth + 1);
      checkNode(edge.children[k]);
    }
    ASSERT_NEAR(lower, edge.lower, 1e-9);
    ASSERT_LE(edge.lower, node.lower + 1e-9);
    ASSERT_LE(scenarios, node.count);
  }
}

TEST(Despot, agreesWithTheExactValueOfTiger) {
  const auto pomdp = tiger();
  const TabularModel model(pomdp, fastInformedBound(*pomdp), pointBasedBound(*pomdp));
  DespotOptions options = unhurried(2000, 5000);
  options.regularisation = 0.2;  // without it the best policy opens doors by heart
  Despot<TabularModel> planner(model, options);
  const Decision decision = planner.decide(*model.makeBelief(0));
  EXPECT_EQ(decision.action, 0);
  EXPECT_NEAR(decision.value, 19.37, 2.5);
}

TEST(Despot, opensTheDoorWithoutTheTigerOnceItIsSureEnough) {
  const TabularModel model(tiger());
  Despot<TabularModel> planner(model, unhurried(500, 5000));
  const auto belief = model.makeBelief(0);
  belief->update(0, 0);
  EXPECT_EQ(planner.decide(*belief).action, 0);
  belief->update(0, 0);
  EXPECT_EQ(planner.decide(*belief).action, 2);
  belief->update(0, 1);
  EXPECT_EQ(planner.decide(*belief).action, 0);
}

TEST(Despot, losesLittleAgainstTheExactPlannerOnRandomModels) {
  std::mt19937 random(5);
  double regret = 0.0;
  for (int i = 0; i < 10; ++i) {
    const auto pomdp = randomPomdp(random, 4, 3, 3, 0.7, 0.3);
    const TabularModel model(pomdp);
    Despot<TabularModel> planner(model, unhurried(1000, 2000));
    const auto values = actionValues(pomdp);
    const double best = *std::max_element(values.begin(), values.end());
    const Decision decision = planner.decide(*model.makeBelief(0));
    // Rewards are in [-1, 1]; the mean of 1000 scenarios has a standard error near 0.03.
    EXPECT_LT(best - values[static_cast<size_t>(decision.action)], 0.15) << "model " << i;
    EXPECT_GT(decision.upper_bound, best - 0.25) << "model " << i;
    EXPECT_LT(decision.lower_bound, best + 0.25) << "model " << i;
    regret += best - values[static_cast<size_t>(decision.action)];
  }
  EXPECT_LT(regret / 10.0, 0.02);
}

TEST(Despot, boundsEveryNodeOfItsTreeFromBothSides) {
  std::mt19937 random(6);
  for (int i = 0; i < 20; ++i) {
    const TabularModel model(randomPomdp(random, 5, 3, 4, 0.9, 0.4));
    DespotOptions options = unhurried(200, 50 * (i + 1));
    options.regularisation = i % 2 == 0 ? 0.0 : 0.01;
    Despot<TabularModel> planner(model, options);
    const Decision decision = planner.decide(*model.makeBelief(0));
    EXPECT_LE(decision.lower_bound, decision.upper_bound);
    EXPECT_GE(decision.value, decision.lower_bound - 1e-9);
    checkNode(planner.tree().root());
  }
}

TEST(Despot, raisesTheLowerAndLowersTheUpperBoundWithMoreNodes) {
  const TabularModel model(tiger());
  double lower = -1e9;
  double upper = 1e9;
  for (const int nodes : {0, 1, 10, 100, 1000, 5000}) {
    Despot<TabularModel> planner(model, unhurried(300, nodes));
    const Decision decision = planner.decide(*model.makeBelief(0));
    EXPECT_GE(decision.lower_bound, lower - 1e-9);
    EXPECT_LE(decision.upper_bound, upper + 1e-9);
    EXPECT_LE(decision.nodes, nodes);
    lower = decision.lower_bound;
    upper = decision.upper_bound;
  }
}

TEST(Despot, repeatsItsDecisionsForASeed) {
  const TabularModel model(tiger());
  const auto decide = [&](std::uint64_t seed) {
    DespotOptions options = unhurried(200, 300);
    options.seed = seed;
    Despot<TabularModel> planner(model, options);
    const Decision first = planner.decide(*model.makeBelief(0));
    const Decision second = planner.decide(*model.makeBelief(0));
    return std::tuple(first.action, first.lower_bound, first.upper_bound, first.nodes,
                      second.action, second.lower_bound, second.upper_bound, second.trials);
  };
  EXPECT_EQ(decide(7), decide(7));
  EXPECT_NE(decide(7), decide(8));
}

TEST(Despot, endsWhenTheMemoryIsUsedUpAndStillAnswers) {
  const TabularModel model(tiger());
  for (const std::size_t memory : {std::size_t{0}, std::size_t{1000}, std::size_t{100000}}) {
    DespotOptions options = unhurried(300, 1000000);
    options.memory = memory;
    Despot<TabularModel> planner(model, options);
    const Decision decision = planner.decide(*model.makeBelief(0));
    EXPECT_LE(planner.tree().arena().used(), memory);
    EXPECT_EQ(decision.ended_by, EndedBy::NODES);
    EXPECT_EQ(decision.fallback_used, memory < 5000);
    EXPECT_LE(decision.lower_bound, decision.upper_bound);
    EXPECT_GE(decision.action, 0);
    EXPECT_LT(decision.action, 3);
  }
}

TEST(Despot, answersWithTheDefaultPolicyWhenThereIsNoTime) {
  const TabularModel model(tiger());
  DespotOptions options;
  options.deadline = 0.0;
  Despot<TabularModel> planner(model, options);
  const Decision decision = planner.decide(*model.makeBelief(0));
  EXPECT_TRUE(decision.fallback_used);
  EXPECT_EQ(decision.ended_by, EndedBy::DEADLINE);
  EXPECT_GE(decision.action, 0);
  EXPECT_LT(decision.action, 3);
}

TEST(Despot, keepsToTheDefaultPolicyWhenPolicyNodesAreDear) {
  const TabularModel model(tiger());
  DespotOptions options = unhurried(300, 1000);
  options.regularisation = 1000.0;
  Despot<TabularModel> planner(model, options);
  const Decision decision = planner.decide(*model.makeBelief(0));
  EXPECT_EQ(decision.ended_by, EndedBy::GAP);
  EXPECT_EQ(decision.action, 0);
  EXPECT_NEAR(decision.value, -20.0, 1e-6);  // listens for ever
}

TEST(Despot, needsNoMoreThanTheRequiredMembers) {
  const BareModel model;
  DespotOptions options = unhurried(50, 200);
  options.depth = 200;
  Despot<BareModel> planner(model, options);
  const Decision decision = planner.decide(*makeBelief(model, 1));
  EXPECT_EQ(decision.action, 1);
  EXPECT_NEAR(decision.lower_bound, 10.0, 1e-6);
  EXPECT_EQ(decision.ended_by, EndedBy::GAP);
}

TEST(Despot, asksTheDefaultPolicyForEachHistoryByItself) {
  const PolicyModel model;
  DespotOptions options = unhurried(64, 0);
  options.depth = 200;
  Despot<PolicyModel> planner(model, options);
  const Decision decision = planner.decide(*makeBelief(model, 1));
  // From the second step on the state was observed, so that the policy is always right.
  EXPECT_GE(decision.lower_bound, 9.0 + 0.4);
  EXPECT_LE(decision.lower_bound, 9.0 + 0.6 + 1e-6);
}

TEST(Despot, refusesOptionsByName) {
  const auto refused = [](const auto& change) {
    DespotOptions options;
    change(options);
    return refusal([&] { checked(options); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_NE(refused([&](auto& o) { o.deadline = nan; }).find("deadline"), std::string::npos);
  EXPECT_NE(refused([&](auto& o) { o.gap = infinity; }).find("gap"), std::string::npos);
  EXPECT_NE(refused([&](auto& o) { o.target = 1.0; }).find("target"), std::string::npos);
  EXPECT_NE(refused([&](auto& o) { o.scenarios = 0; }).find("scenarios"), std::string::npos);
  EXPECT_NE(refused([&](auto& o) { o.depth = 0; }).find("depth"), std::string::npos);
  EXPECT_NE(refused([&](auto& o) { o.max_nodes = -1; }).find("max_nodes"), std::string::npos);
  EXPECT_NE(refused([&](auto& o) { o.regularisation = -1.0; }).find("regularisation"),
            std::string::npos);
  EXPECT_EQ(refused([](auto& /*o*/) {}), "");
}

TEST(ObservationGroups, sortByObservationInTheOrderOfFirstSight) {
  Random random(3);
  ObservationGroups groups(100);
  for (int round = 0; round < 1000; ++round) {
    const int count = random.below(101);
    const int kinds = 1 + random.below(20);
    std::vector<Observation> seen;
    for (int i = 0; i < count; ++i) seen.push_back(mixBits(random.below(kinds)));
    const int parts = groups.group(seen.data(), count);
    std::vector<std::int32_t> expected;
    std::vector<Observation> met;
    for (const Observation o : seen) {
      if (std::find(met.begin(), met.end(), o) != met.end()) continue;
      met.push_back(o);
      for (int i = 0; i < count; ++i) {
        if (seen[static_cast<size_t>(i)] == o) expected.push_back(i);
      }
    }
    ASSERT_EQ(parts, static_cast<int>(met.size()));
    ASSERT_TRUE(std::equal(expected.begin(), expected.end(), groups.order()));
  }
}

TEST(Episodes, repeatForASeed) {
  const TabularModel model(tiger());
  Despot<TabularModel> planner(model, unhurried(50, 20));
  const auto returns = [&](std::uint64_t seed) {
    std::vector<double> values;
    for (const Episode& e : runEpisodes(model, planner, 5, seed, {20})) {
      values.push_back(e.discounted);
    }
    return values;
  };
  EXPECT_EQ(returns(3), returns(3));
  EXPECT_NE(returns(3), returns(4));
}

TEST(Episodes, areSummedUpAsByHand) {
  Episode one;
  one.discounted = 1.0;
  one.undiscounted = 2.0;
  one.trials = 30;
  one.planning_time = {0.25, 0.25};
  Episode two = one;
  two.discounted = 3.0;
  two.planning_time = {0.25, 0.75};
  const EpisodeSummary summary = summarise({one, two});
  EXPECT_DOUBLE_EQ(summary.discounted, 2.0);
  EXPECT_DOUBLE_EQ(summary.discounted_error, 1.0);
  EXPECT_DOUBLE_EQ(summary.undiscounted_error, 0.0);
  EXPECT_DOUBLE_EQ(summary.steps, 2.0);
  EXPECT_DOUBLE_EQ(summary.trials_per_second, 40.0);
  EXPECT_DOUBLE_EQ(summary.planning_median, 0.25);
  EXPECT_DOUBLE_EQ(summary.planning_max, 0.75);
}

}  // namespace
}  // namespace fabric::planner
