// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fabric_planner/mdp.hpp"
#include "fabric_planner/solve.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::blankTables;
using testing::randomPomdp;
using testing::randomRow;
using testing::refusal;

/// The best expected reward within a horizon by trying every plan.
double tryEverything(const Pomdp& m, const Eigen::VectorXd& joint, int horizon) {
  if (horizon == 0 || joint.sum() <= 0.0) return 0.0;
  double best = -std::numeric_limits<double>::infinity();
  for (int a = 0; a < m.numActions(); ++a) {
    if (!m.isAllowed(a, joint)) continue;
    const Eigen::VectorXd predicted = m.T(a).transpose() * joint;
    double value = m.R().row(a).dot(joint);
    for (int o = 0; o < m.numObservations(); ++o) {
      const Eigen::VectorXd next = predicted.cwiseProduct(Eigen::VectorXd(m.O(a).col(o)));
      value += m.discount() * tryEverything(m, next, horizon - 1);
    }
    best = std::max(best, value);
  }
  return best;
}

SolveOptions worth(double work) {
  SolveOptions options;
  options.time = std::numeric_limits<double>::infinity();
  options.work = work;
  options.gap = 0.0;
  return options;
}

/// takeLeaveLook() with another discount and with "take" allowed only where it does no harm.
Pomdp takeLeaveLookVariant(double p, double discount, bool restricted) {
  const auto m = testing::takeLeaveLook(p);
  PomdpTables tables;
  tables.name = "variant";
  tables.states = m->states();
  tables.actions = m->actions();
  tables.observations = m->observations();
  for (int a = 0; a < 3; ++a) {
    tables.T.emplace_back(m->T(a));
    tables.O.emplace_back(m->O(a));
  }
  tables.R = m->R();
  tables.discount = discount;
  tables.initial_belief = m->initialBelief();
  if (restricted) {
    tables.allowed = Flags::Constant(3, 3, true);
    tables.allowed(0, 1) = false;
  }
  return Pomdp(tables);
}

TEST(Solve, BoundsContainTheExactValueOfTwoHundredRandomModels) {
  constexpr int HORIZON = 7;
  std::mt19937 random(101);
  double widest = 0.0;
  for (int i = 0; i < 200; ++i) {
    const int states = 2 + i % 3;
    const auto m = randomPomdp(random, states, 2, 2, 0.5, 0.1 * (i % 5));
    const double exact = tryEverything(*m, m->initialBelief(), HORIZON);
    const double tail = std::pow(0.5, HORIZON) * m->R().cwiseAbs().maxCoeff() / 0.5;
    const Solution solution = solve(*m, worth(1e7));
    EXPECT_LE(solution.lowerValue(), exact + tail + 1e-12) << i;
    EXPECT_GE(solution.upperValue(), exact - tail - 1e-12) << i;
    EXPECT_LE(solution.lowerValue(), solution.upperValue() + 1e-10) << i;
    widest = std::max(widest, solution.gap());
  }
  EXPECT_LT(widest, 0.02);
}

TEST(Solve, BoundsContainTheExactValueEverywhere) {
  constexpr int HORIZON = 7;
  std::mt19937 random(102);
  for (int i = 0; i < 10; ++i) {
    const auto m = randomPomdp(random, 3, 2, 2, 0.5, 0.3);
    const double tail = std::pow(0.5, HORIZON) * m->R().cwiseAbs().maxCoeff() / 0.5;
    const Solution solution = solve(*m, worth(1e6));
    for (int j = 0; j < 10; ++j) {
      const Eigen::VectorXd b = randomRow(random, 3, 0.3).transpose();
      const double exact = tryEverything(*m, b, HORIZON);
      EXPECT_LE(solution.lower.value(b), exact + tail + 1e-12);
      EXPECT_GE(solution.upper.exactValue(b), exact - tail - 1e-12);
      EXPECT_LE(solution.upper.exactValue(b), solution.upper.value(b));
    }
  }
}

TEST(Solve, MoreWorkNeverLoosensABound) {
  std::mt19937 random(103);
  const auto m = randomPomdp(random, 6, 3, 3, 0.95, 0.4);
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  for (const double work : {1e5, 1e6, 1e7, 1e8}) {
    const Solution solution = solve(*m, worth(work));
    EXPECT_GE(solution.lowerValue(), lower);
    EXPECT_LE(solution.upperValue(), upper);
    lower = solution.lowerValue();
    upper = solution.upperValue();
    for (size_t i = 1; i < solution.history.size(); ++i) {
      EXPECT_GE(solution.history[i].lower, solution.history[i - 1].lower);
      EXPECT_LE(solution.history[i].upper, solution.history[i - 1].upper);
      EXPECT_GE(solution.history[i].work, solution.history[i - 1].work);
    }
  }
}

TEST(Solve, WhatItReportsIsWhatItsBoundsSay) {
  std::mt19937 random(104);
  const auto m = randomPomdp(random, 5, 3, 4, 0.9, 0.2);
  const Solution solution = solve(*m, worth(2e7));
  EXPECT_NEAR(solution.lower.value(m->initialBelief()), solution.lowerValue(), 1e-9);
  EXPECT_NEAR(solution.upper.exactValue(m->initialBelief()), solution.upperValue(), 1e-9);
  EXPECT_LT(solution.gap(), 0.5 * (fastInformedBound(*m).value(m->initialBelief()) -
                                   blindBound(*m).value(m->initialBelief())));
}

TEST(Solve, RepeatsExactlyWhenWorkEndsIt) {
  std::mt19937 random(105);
  const auto m = randomPomdp(random, 5, 3, 4, 0.95, 0.2);
  const Solution first = solve(*m, worth(2e7));
  const Solution second = solve(*m, worth(2e7));
  EXPECT_EQ(first.lower.vectors, second.lower.vectors);
  EXPECT_EQ(first.upper.points(), second.upper.points());
  EXPECT_EQ(first.upper.values(), second.upper.values());
}

TEST(Solve, UpperBoundIsConvexAndScales) {
  // Only the best weights make it convex: a bound from worse ones would show here.
  std::mt19937 random(106);
  const auto m = randomPomdp(random, 6, 3, 3, 0.95, 0.4);
  const PointUpperBound upper = solve(*m, worth(3e7)).upper;
  ASSERT_GT(upper.points().cols(), 20);
  for (int i = 0; i < 200; ++i) {
    const Eigen::VectorXd b = randomRow(random, 6, 0.3).transpose();
    const Eigen::VectorXd c = randomRow(random, 6, 0.3).transpose();
    const Eigen::VectorXd between = 0.25 * b + 0.75 * c;
    const auto interpolated = [&](const Eigen::VectorXd& x) { return upper.exactValue(x); };
    EXPECT_LE(interpolated(between), upper.base().value(between) + 1e-9);
    EXPECT_NEAR(upper.value(0.125 * b), 0.125 * upper.value(b), 1e-9);
    EXPECT_NEAR(interpolated(0.125 * b), 0.125 * interpolated(b), 1e-7);
  }
  const Eigen::MatrixXd points = upper.points();
  const Eigen::VectorXd values = upper.values();
  for (Eigen::Index k = 0; k + 1 < points.cols(); ++k) {
    const Eigen::VectorXd middle = 0.5 * (points.col(k) + points.col(k + 1));
    EXPECT_LE(upper.exactValue(middle), 0.5 * (values(k) + values(k + 1)) + 1e-7);
  }
}

TEST(Solve, IsExactWhereTheStateIsSeen) {
  std::mt19937 random(107);
  auto tables = testing::randomTables(random, 4, 3, 4, 0.9);
  for (auto& O : tables.O) O.setIdentity();
  const Solution solution = solve(Pomdp(tables));
  EXPECT_NEAR(solution.gap(), 0.0, 1e-9);
}

TEST(Solve, KnowsDiscountOneWhereEverythingEnds) {
  for (const double p : {0.05, 0.5, 0.97}) {
    const Pomdp m = takeLeaveLookVariant(p, 1.0, false);
    const double exact = std::max({0.0, 3.0 * p - 2.0, -0.1 + p});
    const Solution solution = solve(m, worth(1e6));
    EXPECT_NEAR(solution.lowerValue(), exact, 1e-9) << p;
    EXPECT_NEAR(solution.upperValue(), exact, 1e-6) << p;
  }
}

TEST(Solve, SaysSoWhereDiscountOneNeverSettles) {
  auto tables = blankTables(1, 1, 1, 1.0);
  tables.O[0].setOnes();
  tables.T[0].setOnes();
  tables.R << 1.0;
  EXPECT_NE(refusal([&] { solve(Pomdp(tables)); }), "");
}

TEST(Solve, TakesNoActionThatAPossibleStateForbids) {
  for (const double p : {0.05, 0.5, 0.97}) {
    for (const double discount : {0.9, 1.0}) {
      const Pomdp m = takeLeaveLookVariant(p, discount, true);
      // By hand: taking blindly is out, looking first costs 0.1 and a step.
      const double exact = std::max(0.0, -0.1 + discount * p);
      const Solution solution = solve(m, worth(1e6));
      EXPECT_NEAR(solution.lowerValue(), exact, 1e-9) << p;
      EXPECT_NEAR(solution.upperValue(), exact, 1e-6) << p;
      const int best = solution.lower.best(m.initialBelief());
      EXPECT_NE(solution.lower.actions[static_cast<size_t>(best)], 0);
    }
  }
}

TEST(Solve, MdpHonoursActionSets) {
  const Pomdp m = takeLeaveLookVariant(0.5, 0.9, true);
  for (const MdpSolution& solution : {valueIteration(m), policyIteration(m)}) {
    EXPECT_EQ(solution.q(0, 1), -std::numeric_limits<double>::infinity());
    EXPECT_NE(solution.policy[1], 0);
    EXPECT_NEAR(solution.value(0), 1.0, 1e-9);
    EXPECT_NEAR(solution.value(1), 0.0, 1e-9);
  }
}

TEST(Solve, ValueAndPolicyIterationAgree) {
  std::mt19937 random(108);
  for (int i = 0; i < 10; ++i) {
    const auto m = randomPomdp(random, 12, 4, 2, 0.97, 0.6);
    const MdpSolution values = valueIteration(*m, 1e-10);
    const MdpSolution policies = policyIteration(*m);
    EXPECT_TRUE(values.value.isApprox(policies.value, 1e-8));
    EXPECT_TRUE((values.value.array() >= policies.value.array() - 1e-9).all());
  }
}

TEST(Solve, RefusesOptionsOutOfRangeByName) {
  const auto m = testing::takeLeaveLook(0.5);
  SolveOptions options;
  options.gap = std::nan("");
  EXPECT_NE(refusal([&] { solve(*m, options); }).find("option gap is nan"), std::string::npos);
  options = SolveOptions{};
  options.time = 0.0;
  EXPECT_NE(refusal([&] { solve(*m, options); }).find("option time is 0"), std::string::npos);
}

}  // namespace
}  // namespace fabric::planner
