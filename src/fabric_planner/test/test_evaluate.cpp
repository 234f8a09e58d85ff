// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "fabric_planner/evaluate.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::randomPomdp;
using testing::refusal;
using testing::takeLeaveLook;

BeliefPolicy always(int action) {
  return {[action](const Eigen::VectorXd&) { return action; }, nullptr, nullptr};
}

/// The value of one action for ever from the initial belief.
double valueOf(const Pomdp& m, int action) {
  return blindBound(m).vectors.row(action).dot(m.initialBelief());
}

TEST(Evaluate, ReturnAndCvAreBothTheValueOfThePolicy) {
  std::mt19937 random(41);
  for (int i = 0; i < 4; ++i) {
    const auto m = randomPomdp(random, 6, 3, 4, 0.9, 0.3);
    const Evaluation e = evaluate(*m, always(1), pointBasedBound(*m), {400, 0, 7});
    const double exact = valueOf(*m, 1);
    EXPECT_NEAR(e.mean_return, exact, 4.5 * e.standard_error + 1e-4);
    EXPECT_NEAR(e.cv, exact, 4.5 * e.cv_standard_error + 1e-4);
  }
}

TEST(Evaluate, CvHoldsForAnyReferenceAndIsSteadierForAGoodOne) {
  std::mt19937 random(42);
  const auto m = randomPomdp(random, 6, 3, 4, 0.9, 0.3);
  const AlphaVectors good = pointBasedBound(*m);
  const AlphaVectors odd{Eigen::MatrixXd::Random(3, 6), {0, 1, 2}};
  const BeliefPolicy policy = policyOf(*m, good);
  const Evaluation one = evaluate(*m, policy, good, {300, 0, 1});
  const Evaluation other = evaluate(*m, policy, odd, {300, 0, 1});
  EXPECT_NEAR(one.cv, other.cv, 4.5 * (one.cv_standard_error + other.cv_standard_error) + 1e-4);
  EXPECT_LT(one.cv_standard_error, 0.1 * one.standard_error);
  EXPECT_EQ(one.mean_return, other.mean_return) << "the same luck";
}

TEST(Evaluate, AnOptimalPolicyIsWorthItsValueWithoutAnyNoiseOfCv) {
  const auto m = takeLeaveLook(0.5);
  OnlinePlanner planner(m, {1e6, 1e-9, 1000});
  const Evaluation e = evaluate(*m, policyOf(planner), pointBasedBound(*m), {50, 0, 1});
  EXPECT_NEAR(e.cv, 0.35, 1e-9);
  EXPECT_NEAR(e.cv_standard_error, 0.0, 1e-9);
  EXPECT_GT(e.decision_time, 0.0);
  EXPECT_GE(e.decisions, 50);
}

TEST(Evaluate, RepeatsExactlyAndDependsOnTheSeed) {
  std::mt19937 random(43);
  const auto m = randomPomdp(random, 5, 2, 3, 0.9);
  OnlinePlanner planner(m, {1e6, 1e-3, 20});
  const AlphaVectors reference = blindBound(*m);
  const Evaluation first = evaluate(*m, policyOf(planner), reference, {20, 30, 5});
  const Evaluation again = evaluate(*m, policyOf(planner), reference, {20, 30, 5});
  EXPECT_EQ(first.mean_return, again.mean_return);
  EXPECT_EQ(first.cv, again.cv);
  EXPECT_NE(first.mean_return, evaluate(*m, policyOf(planner), reference, {20, 30, 6}).mean_return);
}

TEST(Evaluate, MeasuresOnlyTheReturnWithoutAReference) {
  const auto m = takeLeaveLook(0.5);
  const Evaluation e = evaluate(*m, always(1), {}, {10, 0, 1});
  EXPECT_EQ(e.mean_return, 0.0);
  EXPECT_TRUE(std::isnan(e.cv));
}

TEST(Evaluate, RefusesBadOptionsByName) {
  const auto m = takeLeaveLook(0.5);
  EXPECT_EQ(refusal([&] {
              evaluate(*m, always(0), {}, {1, 0, 1});
            }),
            "test: episodes is 1, expected at least 2");
  EXPECT_EQ(refusal([&] {
              evaluate(*m, always(0), {}, {10, -1, 1});
            }),
            "test: steps is -1, below 0");
  EXPECT_EQ(refusal([&] {
              evaluate(*m, always(0), {Eigen::MatrixXd::Zero(1, 2), {0}}, {});
            }),
            "test: the reference has 2 columns for 3 states");
  EXPECT_THROW(evaluate(*m, always(9), {}, {10, 5, 1}), std::out_of_range);
}

TEST(Simulate, EndsWhereTheModelEnds) {
  const auto m = takeLeaveLook(0.5);
  const auto taken = simulate(*m, always(0), 100, 1);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].reward, taken[0].state == 0 ? 1.0 : -2.0);
  EXPECT_EQ(taken[0].belief, m->initialBelief());
  const auto looking = simulate(*m, always(2), 100, 1);
  ASSERT_EQ(looking.size(), 100U);
  for (size_t t = 0; t < looking.size(); ++t) {
    EXPECT_EQ(looking[t].observation, looking[t].state);
    EXPECT_EQ(looking[t].belief(looking[t].state), t == 0 ? 0.5 : 1.0);
  }
}

TEST(VectorPolicy, TakesTheBestActionThatIsAllowed) {
  PomdpTables tables = testing::blankTables(2, 2, 1, 0.9);
  for (auto& T : tables.T) T.setIdentity();
  for (auto& O : tables.O) O.setOnes();
  tables.allowed.resize(2, 2);
  tables.allowed << true, false, true, true;
  const Pomdp m(tables);
  Eigen::MatrixXd vectors(2, 2);
  vectors << 5.0, 5.0, 1.0, 1.0;
  const BeliefPolicy policy = policyOf(m, {vectors, {0, 1}});
  EXPECT_EQ(policy.decide(Eigen::Vector2d(1.0, 0.0)), 0);
  EXPECT_EQ(policy.decide(Eigen::Vector2d(0.5, 0.5)), 1);
}

}  // namespace
}  // namespace fabric::planner
