// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/mdp.hpp"
#include "fabric_planner/pomdpx.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::blankTables;
using testing::randomPomdp;
using testing::refusal;
using testing::takeLeaveLook;

constexpr double TIGER_VALUE = 19.3713;  // exact value of the uniform belief, discount 0.95

Pomdp tiger() { return loadPomdpx(std::string(PACKAGE_DIR) + "/test/models/tiger.pomdpx"); }

TEST(Mdp, SolvesATwoStateChainWorkedByHand) {
  // s0: "a0" stays and pays 1, "a1" goes to s1 for ever and pays 2 a step there. Discount 0.8.
  auto tables = blankTables(2, 2, 1, 0.8);
  for (size_t a = 0; a < 2; ++a) tables.O[a].setOnes();
  tables.T[0].setIdentity();
  tables.T[1] << 0.0, 1.0, 0.0, 1.0;
  tables.R << 1.0, 2.0, 0.0, 2.0;
  const auto solution = solveMdp(Pomdp(tables));
  EXPECT_NEAR(solution.value(1), 10.0, 1e-12);
  EXPECT_NEAR(solution.value(0), 8.0, 1e-12);
  EXPECT_EQ(solution.policy[0], 1);
  EXPECT_NEAR(solution.q(0, 0), 1.0 + 0.8 * 8.0, 1e-12);
}

TEST(Mdp, SatisfiesTheBellmanEquation) {
  std::mt19937 random(5);
  for (int i = 0; i < 20; ++i) {
    const auto m = randomPomdp(random, 9, 4, 2, 0.95, 0.5);
    const auto solution = solveMdp(*m);
    for (int a = 0; a < 4; ++a) {
      const Eigen::VectorXd q = m->R().row(a).transpose() + 0.95 * (m->T(a) * solution.value);
      EXPECT_TRUE(q.isApprox(solution.q.row(a).transpose(), 1e-10));
    }
    EXPECT_TRUE(solution.q.colwise().maxCoeff().transpose().isApprox(solution.value, 1e-10));
  }
}

TEST(Mdp, SolvesDiscountOneWhenEverythingEnds) {
  auto tables = blankTables(3, 1, 1, 1.0);
  tables.O[0].setOnes();
  tables.T[0] << 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0;
  tables.R << 3.0, 4.0, 0.0;
  EXPECT_NEAR(solveMdp(Pomdp(tables)).value(0), 7.0, 1e-12);
}

TEST(Mdp, SaysSoWhenDiscountOneNeverSettles) {
  auto tables = blankTables(1, 1, 1, 1.0);
  tables.O[0].setOnes();
  tables.T[0].setOnes();
  tables.R << 1.0;
  EXPECT_NE(refusal([&] { solveMdp(Pomdp(tables)); }).find("does not settle"), std::string::npos);
}

TEST(Bounds, TigerIsExactFromBelowAndAbove) {
  const auto m = tiger();
  EXPECT_NEAR(pointBasedBound(m).value(m.initialBelief()), TIGER_VALUE, 1e-3);
  EXPECT_NEAR(pointBasedUpperBound(m).value(m.initialBelief()), TIGER_VALUE, 1e-3);
}

TEST(Bounds, AgreeWithAModelSolvedByHand) {
  for (const double p : {0.05, 0.3, 0.5, 0.9, 0.97}) {
    const auto m = takeLeaveLook(p);
    const double exact = std::max({0.0, 3.0 * p - 2.0, -0.1 + 0.9 * p});
    EXPECT_NEAR(pointBasedBound(*m).value(m->initialBelief()), exact, 1e-9) << p;
    EXPECT_NEAR(pointBasedUpperBound(*m).value(m->initialBelief()), exact, 1e-6) << p;
  }
}

TEST(Bounds, AreOrderedAtEveryBelief) {
  std::mt19937 random(11);
  UpperBoundOptions little;
  little.work = 1e8;
  for (int i = 0; i < 10; ++i) {
    const auto m = randomPomdp(random, 5, 3, 3, 0.9, 0.3);
    const auto blind = blindBound(*m);
    const auto lower = pointBasedBound(*m);
    const PointUpperBound upper = pointBasedUpperBound(*m, little);
    const auto informed = fastInformedBound(*m);
    const auto with_state = qmdp(*m);
    for (int j = 0; j < 200; ++j) {
      const Eigen::VectorXd b = testing::randomRow(random, 5, 0.3).transpose();
      EXPECT_LE(lower.value(b), upper.value(b) + 1e-9);
      EXPECT_LE(blind.value(b), upper.value(b) + 1e-9);
      EXPECT_LE(upper.value(b), informed.value(b) + 1e-9);
      EXPECT_LE(informed.value(b), with_state.value(b) + 1e-9);
    }
    EXPECT_GE(lower.value(m->initialBelief()), blind.value(m->initialBelief()) - 1e-12);
  }
}

TEST(Bounds, UpperBoundScalesWithTheBelief) {
  std::mt19937 random(12);
  const auto m = randomPomdp(random, 4, 2, 3, 0.9);
  const auto upper = pointBasedUpperBound(*m);
  const Eigen::VectorXd b = testing::randomRow(random, 4, 0.0).transpose();
  EXPECT_NEAR(upper.value(0.125 * b), 0.125 * upper.value(b), 1e-12);
}

TEST(Bounds, AreExactWhenTheStateIsSeen) {
  std::mt19937 random(13);
  auto tables = testing::randomTables(random, 4, 3, 4, 0.9);
  for (auto& O : tables.O) O.setIdentity();
  const Pomdp m(tables);
  const auto exact = solveMdp(m);
  EXPECT_TRUE(pointBasedBound(m).vectors.isApprox(exact.q, 1e-12));
  EXPECT_TRUE(fastInformedBound(m).vectors.isApprox(exact.q, 1e-9));
}

TEST(Bounds, RepeatExactly) {
  const auto m = tiger();
  EXPECT_EQ(pointBasedBound(m).vectors, pointBasedBound(m).vectors);
}

TEST(Bounds, RefuseDiscountOneWhereNothingEnds) {
  auto tables = blankTables(1, 1, 1, 1.0);
  tables.O[0].setOnes();
  tables.T[0].setOnes();
  tables.R << 1.0;
  const Pomdp m(tables);
  EXPECT_NE(refusal([&] { fastInformedBound(m); }).find("does not settle"), std::string::npos);
  const auto blind = refusal([&] { blindBound(m); });
  EXPECT_NE(blind.find("needs a discount below 1"), std::string::npos) << blind;
}

}  // namespace
}  // namespace fabric::planner
