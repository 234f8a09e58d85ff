// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/pomdp.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::blankTables;
using testing::randomPomdp;
using testing::randomTables;
using testing::refusal;

PomdpTables goodTables() {
  std::mt19937 random(1);
  return randomTables(random, 3, 2, 2, 0.9);
}

std::string refusalOf(const PomdpTables& tables) {
  return refusal([&] { Pomdp{tables}; });
}

TEST(Pomdp, RefusesARowThatDoesNotSumToOneNamingElementRowAndSum) {
  auto tables = goodTables();
  tables.T[1].row(2) << 0.5, 0.4, 0.03;
  EXPECT_EQ(refusalOf(tables), "test: T[a1] row s2 sums to 0.93, not 1");
  tables = goodTables();
  tables.O[0].row(1) << 0.5, 0.6;
  EXPECT_EQ(refusalOf(tables), "test: O[a0] row s1 sums to 1.1, not 1");
}

TEST(Pomdp, RefusesNanAndInfinityByName) {
  auto tables = goodTables();
  tables.T[0](1, 2) = std::nan("");
  EXPECT_EQ(refusalOf(tables), "test: T[a0] row s1 column s2 is NaN");
  tables = goodTables();
  tables.R(1, 0) = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusalOf(tables), "test: R[a1] at s0 is infinite");
  tables = goodTables();
  tables.discount = std::nan("");
  EXPECT_EQ(refusalOf(tables), "test: discount is NaN");
}

TEST(Pomdp, RefusesWhatIsNoProbability) {
  auto tables = goodTables();
  tables.T[0].row(0) << -0.5, 1.0, 0.5;
  EXPECT_EQ(refusalOf(tables), "test: T[a0] row s0 column s0 is -0.5, not a probability");
}

TEST(Pomdp, RefusesNamesThatAreTwiceOrEmpty) {
  auto tables = goodTables();
  tables.states[2] = "s0";
  EXPECT_EQ(refusalOf(tables), "test: states: 's0' is named twice");
  tables = goodTables();
  tables.actions[0] = "go left";
  EXPECT_NE(refusalOf(tables).find("'go left'"), std::string::npos);
}

TEST(Pomdp, RefusesTablesOfTheWrongSize) {
  auto tables = goodTables();
  tables.O[1] = Eigen::MatrixXd::Ones(3, 1);
  EXPECT_EQ(refusalOf(tables), "test: O[a1] is 3 x 1, expected 3 x 2");
  tables = goodTables();
  tables.T.pop_back();
  EXPECT_NE(refusalOf(tables).find("one table for each of the 2 actions"), std::string::npos);
  tables = goodTables();
  tables.initial_belief = Eigen::VectorXd::Ones(1);
  EXPECT_EQ(refusalOf(tables), "test: belief has 1 entries for 3 states");
}

TEST(Pomdp, RefusesADiscountOutsideZeroToOne) {
  for (const double discount : {0.0, -0.5, 1.01}) {
    auto tables = goodTables();
    tables.discount = discount;
    EXPECT_NE(refusalOf(tables).find("not in (0, 1]"), std::string::npos) << discount;
  }
}

TEST(Pomdp, AcceptsASumThatIsOffByLessThanAMillionthAndRescalesIt) {
  auto tables = goodTables();
  tables.T[0].row(0) << 0.5, 0.25, 0.2500005;
  const Pomdp model(tables);
  EXPECT_NEAR(model.T(0).row(0).sum(), 1.0, 1e-15);
}

TEST(Pomdp, FindsTerminalStates) {
  auto tables = goodTables();
  for (auto& T : tables.T) T.row(1) << 0.0, 1.0, 0.0;
  EXPECT_FALSE(Pomdp(tables).terminal()[1]) << "it still pays";
  tables.R.col(1).setZero();
  EXPECT_EQ(Pomdp(tables).terminal(), (std::vector<bool>{false, true, false}));
}

TEST(Pomdp, KnowsWhetherObservationsTellTheState) {
  EXPECT_FALSE(Pomdp(goodTables()).fullyObservable());
  auto tables = blankTables(2, 2, 2, 0.5);
  for (size_t a = 0; a < 2; ++a) tables.T[a].setIdentity();
  for (size_t a = 0; a < 2; ++a) tables.O[a].setIdentity();
  EXPECT_TRUE(Pomdp(tables).fullyObservable());
  tables.O[1] << 0.0, 1.0, 1.0, 0.0;
  EXPECT_FALSE(Pomdp(tables).fullyObservable()) << "o0 means two different states";
}

TEST(Pomdp, NamesWhatItKnowsWhenAskedForAnUnknownName) {
  const Pomdp model(goodTables());
  EXPECT_EQ(model.actionIndex("a1"), 1);
  EXPECT_EQ(refusal([&] { (void)model.actionIndex("dance"); }),
            "test: unknown action 'dance' (known: a0, a1)");
}

TEST(BeliefFilter, AgreesWithBayesRuleWorkedByHand) {
  auto tables = blankTables(2, 1, 2, 0.9);
  tables.T[0] << 0.9, 0.1, 0.2, 0.8;
  tables.O[0] << 0.7, 0.3, 0.4, 0.6;
  tables.initial_belief << 0.5, 0.5;
  BeliefFilter filter(std::make_shared<Pomdp>(tables));
  EXPECT_EQ(filter.update(0, 0), UpdateStatus::OK);
  // Predicted (0.55, 0.45); times (0.7, 0.4) is (0.385, 0.18); the sum is 0.565.
  EXPECT_NEAR(filter.belief()(0), 0.385 / 0.565, 1e-15);
  EXPECT_EQ(filter.recoveries(), 0U);
}

TEST(BeliefFilter, TakesTheStatesAnImpossibleObservationCanComeFrom) {
  auto tables = blankTables(3, 1, 3, 0.9);
  tables.T[0].setIdentity();
  tables.O[0] << 1.0, 0.0, 0.0, 0.4, 0.6, 0.0, 0.7, 0.3, 0.0;
  BeliefFilter filter(std::make_shared<Pomdp>(tables));
  EXPECT_EQ(filter.update(0, 1), UpdateStatus::RECOVERED);
  EXPECT_TRUE(filter.belief().isApprox(Eigen::Vector3d(0.0, 0.6, 0.3) / 0.9));
  EXPECT_EQ(filter.recoveries(), 1U);
}

TEST(BeliefFilter, KeepsThePredictionWhenAnObservationComesFromNowhere) {
  auto tables = blankTables(2, 1, 2, 0.9);
  tables.T[0] << 0.9, 0.1, 0.2, 0.8;
  tables.O[0].col(0).setOnes();
  BeliefFilter filter(std::make_shared<Pomdp>(tables));
  EXPECT_EQ(filter.update(0, 1), UpdateStatus::RECOVERED);
  EXPECT_TRUE(filter.belief().isApprox(Eigen::Vector2d(0.9, 0.1)));
  filter.reset();
  EXPECT_EQ(filter.recoveries(), 0U);
}

TEST(BeliefFilter, RefusesIndicesAndBeliefsThatAreNone) {
  std::mt19937 random(3);
  BeliefFilter filter(randomPomdp(random, 2, 2, 2, 0.9));
  EXPECT_THROW(filter.update(2, 0), std::out_of_range);
  EXPECT_THROW(filter.update(0, -1), std::out_of_range);
  EXPECT_THROW(filter.reset(Eigen::Vector2d(0.5, 0.4)), ModelError);
  EXPECT_THROW(filter.reset(Eigen::Vector2d(std::nan(""), 1.0)), ModelError);
}

TEST(BeliefFilter, StaysADistributionThroughAMillionRandomUpdates) {
  std::mt19937 random(42);
  std::uint64_t recoveries = 0;
  int updates = 0;
  while (updates < 1000000) {
    const int states = 2 + static_cast<int>(random() % 12);
    const int actions = 1 + static_cast<int>(random() % 4);
    const int observations = 1 + static_cast<int>(random() % 8);
    const double zeros = 0.3 * static_cast<double>(random() % 4);
    BeliefFilter filter(randomPomdp(random, states, actions, observations, 0.9, zeros));
    for (int i = 0; i < 2500; ++i, ++updates) {
      filter.update(static_cast<int>(random() % static_cast<unsigned>(actions)),
                    static_cast<int>(random() % static_cast<unsigned>(observations)));
      const double sum = filter.belief().sum();
      ASSERT_TRUE(std::abs(sum - 1.0) < 1e-12 && filter.belief().minCoeff() >= 0.0)
          << "update " << updates << ": " << filter.belief().transpose();
    }
    recoveries += filter.recoveries();
  }
  EXPECT_GT(recoveries, 1000U) << "the test should have met impossible observations";
}

}  // namespace
}  // namespace fabric::planner
