// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/pomdpx.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::randomPomdp;
using testing::refusal;
using testing::takeLeaveLook;

constexpr double AMPLE = 1e6;  // s: a deadline that never ends a search

std::shared_ptr<const Pomdp> tiger() {
  return std::make_shared<Pomdp>(
      loadPomdpx(std::string(PACKAGE_DIR) + "/test/models/tiger.pomdpx"));
}

/// The value of the best plan of `steps` steps, by trying all of them.
double tryEverything(const Pomdp& m, const Eigen::VectorXd& belief, int steps) {
  if (steps == 0) return 0.0;
  double best = -1e300;
  for (int a = 0; a < m.numActions(); ++a) {
    double value = m.R().row(a).dot(belief);
    const Eigen::VectorXd predicted = m.T(a).transpose() * belief;
    for (int o = 0; o < m.numObservations(); ++o) {
      const Eigen::VectorXd joint = predicted.cwiseProduct(Eigen::VectorXd(m.O(a).col(o)));
      const double probability = joint.sum();
      if (probability <= 0.0) continue;
      value += m.discount() * probability * tryEverything(m, joint / probability, steps - 1);
    }
    best = std::max(best, value);
  }
  return best;
}

TEST(OnlinePlanner, ListensFirstOnTigerAtItsExactValue) {
  OnlinePlanner planner(tiger(), {AMPLE, 1e-3, 5000});
  const auto decision = planner.decide(Eigen::Vector2d(0.5, 0.5));
  EXPECT_EQ(planner.model().actions()[static_cast<size_t>(decision.action)], "listen");
  EXPECT_EQ(decision.ended_by, EndedBy::GAP);
  EXPECT_NEAR(decision.value, 19.3713, 2e-3);
  EXPECT_LE(decision.upper_bound - decision.lower_bound, 1e-3);
  EXPECT_FALSE(decision.fallback_used);
}

TEST(OnlinePlanner, OpensTheOtherDoorOnceItIsSure) {
  OnlinePlanner planner(tiger(), {AMPLE, 1e-3, 5000});
  const auto decision = planner.decide(Eigen::Vector2d(0.99, 0.01));
  EXPECT_EQ(planner.model().actions()[static_cast<size_t>(decision.action)], "open_right");
}

TEST(OnlinePlanner, AgreesWithAModelSolvedByHand) {
  const auto m = takeLeaveLook(0.5);
  OnlinePlanner planner(m, {AMPLE, 1e-9, 1000});
  auto decision = planner.decide(m->initialBelief());
  EXPECT_EQ(decision.action, 2) << "look";
  EXPECT_NEAR(decision.value, 0.35, 1e-9);
  EXPECT_EQ(decision.runner_up, 1) << "leave";
  EXPECT_NEAR(decision.runner_up_gap, 0.35, 1e-9);
  decision = planner.decide(Eigen::Vector3d(0.95, 0.05, 0.0));
  EXPECT_EQ(decision.action, 0) << "take";
  EXPECT_NEAR(decision.value, 0.85, 1e-9);
}

TEST(OnlinePlanner, BoundsContainTheBestPlanFoundByTryingThemAll) {
  std::mt19937 random(21);
  const double discount = 0.5;
  const int steps = 8;
  const double rest = std::pow(discount, steps) / (1.0 - discount);  // |reward| <= 1
  for (int i = 0; i < 15; ++i) {
    const auto m = randomPomdp(random, 3, 2, 2, discount, 0.2);
    const double best = tryEverything(*m, m->initialBelief(), steps);
    for (const int nodes : {1, 10, 300}) {
      OnlinePlanner planner(m, {AMPLE, 0.0, nodes});
      const auto decision = planner.decide(m->initialBelief());
      EXPECT_LE(decision.lower_bound, best + rest);
      EXPECT_GE(decision.upper_bound, best - rest);
      EXPECT_NEAR(decision.value, decision.lower_bound, 1e-9);
    }
  }
}

TEST(OnlinePlanner, BoundsOnlyTightenWithMoreNodes) {
  std::mt19937 random(22);
  for (int i = 0; i < 5; ++i) {
    const auto m = randomPomdp(random, 6, 3, 3, 0.9, 0.3);
    double lower = -1e300;
    double upper = 1e300;
    for (const int nodes : {0, 1, 5, 50, 500, 3000}) {
      OnlinePlanner planner(m, {AMPLE, 0.0, nodes});
      const auto decision = planner.decide(m->initialBelief());
      EXPECT_GE(decision.lower_bound, lower - 1e-9);
      EXPECT_LE(decision.upper_bound, upper + 1e-9);
      EXPECT_LE(decision.lower_bound, decision.upper_bound);
      EXPECT_LE(decision.nodes, nodes);
      lower = decision.lower_bound;
      upper = decision.upper_bound;
    }
  }
}

TEST(OnlinePlanner, GivesTheSameDecisionForTheSameBelief) {
  std::mt19937 random(23);
  const auto m = randomPomdp(random, 8, 4, 4, 0.95, 0.3);
  OnlinePlanner one(m, {AMPLE, 1e-6, 400});
  OnlinePlanner other(m, {AMPLE, 1e-6, 400});
  for (int i = 0; i < 10; ++i) {
    const Eigen::VectorXd belief = testing::randomRow(random, 8, 0.3).transpose();
    const auto first = one.decide(belief);
    for (const auto& again : {one.decide(belief), other.decide(belief)}) {
      EXPECT_EQ(first.action, again.action);
      EXPECT_EQ(first.value, again.value);
      EXPECT_EQ(first.upper_bound, again.upper_bound);
      EXPECT_EQ(first.nodes, again.nodes);
      EXPECT_EQ(first.ended_by, again.ended_by);
    }
  }
}

TEST(OnlinePlanner, FallsBackOnTheOfflinePolicyWhenItMayNotSearch) {
  const auto m = tiger();
  for (const auto& options : {PlannerOptions{0.0, 1e-3, 5000}, PlannerOptions{AMPLE, 1e-3, 0}}) {
    OnlinePlanner planner(m, options);
    const auto decision = planner.decide(m->initialBelief());
    EXPECT_TRUE(decision.fallback_used);
    EXPECT_EQ(decision.nodes, 0);
    EXPECT_EQ(decision.action, 0) << "listen";
    EXPECT_NEAR(decision.value, 19.3713, 1e-3);
  }
}

TEST(OnlinePlanner, EndsByDeadlineWithWhatItHas) {
  std::mt19937 random(24);
  const auto m = randomPomdp(random, 20, 4, 6, 0.99);
  OnlinePlanner planner(m, {0.02, 0.0, 100000});
  const auto decision = planner.decide(m->initialBelief());
  EXPECT_EQ(decision.ended_by, EndedBy::DEADLINE);
  EXPECT_LT(decision.nodes, 100000);
  EXPECT_LE(decision.lower_bound, decision.upper_bound);
  EXPECT_EQ(decision.deadline_missed, decision.planning_time > 0.02);
}

TEST(OnlinePlanner, ExpectsNothingOfTerminalStates) {
  const auto m = takeLeaveLook(0.5);
  OnlinePlanner planner(m, {AMPLE, 0.0, 100});
  const auto decision = planner.decide(Eigen::Vector3d(0.0, 0.0, 1.0));
  EXPECT_EQ(decision.ended_by, EndedBy::GAP);
  EXPECT_EQ(decision.value, 0.0);
  EXPECT_EQ(decision.upper_bound, 0.0);
}

TEST(OnlinePlanner, HasNoRunnerUpWhenThereIsOneAction) {
  std::mt19937 random(25);
  const auto m = randomPomdp(random, 3, 1, 2, 0.9);
  OnlinePlanner planner(m, {AMPLE, 1e-3, 100});
  const auto decision = planner.decide(m->initialBelief());
  EXPECT_EQ(decision.runner_up, -1);
  EXPECT_EQ(decision.runner_up_gap, 0.0);
}

TEST(OnlinePlanner, RefusesBadOptionsAndBeliefs) {
  const auto m = tiger();
  EXPECT_NE(refusal([&] {
              OnlinePlanner(m, {-1.0, 1e-3, 10});
            }).find("deadline"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              OnlinePlanner(m, {1.0, std::nan(""), 10});
            }).find("gap is nan"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              OnlinePlanner(m, {1.0, 0.1, -1});
            }).find("max_nodes"),
            std::string::npos);
  OnlinePlanner planner(m, {});
  EXPECT_EQ(refusal([&] { planner.decide(Eigen::Vector2d(0.5, 0.6)); }),
            "tiger: belief sums to 1.1, not 1");
}

TEST(OnlinePlanner, ServesSeveralThreads) {
  const auto m = tiger();
  OnlinePlanner planner(m, {AMPLE, 0.0, 200});
  const auto alone = planner.decide(Eigen::Vector2d(0.6, 0.4));
  std::vector<double> values(4);
  std::vector<std::thread> threads;
  for (auto& value : values) {
    threads.emplace_back([&planner, &value] {
      for (int i = 0; i < 20; ++i) value = planner.decide(Eigen::Vector2d(0.6, 0.4)).upper_bound;
    });
  }
  for (auto& thread : threads) thread.join();
  for (const double value : values) EXPECT_EQ(value, alone.upper_bound);
}

}  // namespace
}  // namespace fabric::planner
