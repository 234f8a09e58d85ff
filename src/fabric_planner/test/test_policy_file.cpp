// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "fabric_planner/policy_file.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::refusal;

/// "x/y" states: x (2 values) is seen, y (3 values) is hidden.
Pomdp mixedModel(const std::vector<std::string>& states = {"l/u", "l/m", "l/d", "r/u", "r/m",
                                                           "r/d"}) {
  PomdpTables tables = testing::blankTables(6, 2, 2, 0.9);
  tables.states = states;
  for (int a = 0; a < 2; ++a) {
    tables.T[static_cast<size_t>(a)].setConstant(1.0 / 6.0);
    for (int s = 0; s < 6; ++s) tables.O[static_cast<size_t>(a)](s, s / 3) = 1.0;
  }
  return Pomdp(tables);
}

std::string document(const std::string& attributes, const std::string& vectors) {
  return "<?xml version='1.0' encoding='ISO-8859-1'?>\n<Policy version='0.1' type='value' "
         "model='m.pomdpx'>\n<AlphaVector " +
         attributes + ">\n" + vectors + "</AlphaVector>\n</Policy>\n";
}

std::string twoStates(const std::string& vectors) {
  return document("vectorLength='2' numObsValue='1'", vectors);
}

Pomdp twoStateModel() {
  PomdpTables tables = testing::blankTables(2, 3, 1, 0.9);
  for (auto& T : tables.T) T.setIdentity();
  for (auto& O : tables.O) O.setOnes();
  return Pomdp(tables);
}

std::string refusalOf(const std::string& text) {
  return refusal([&] { parsePolicy(text, twoStateModel()); });
}

TEST(PolicyFile, ReadsVectorsWithTheirActions) {
  const auto policy =
      parsePolicy(document("vectorLength='2' numObsValue='1' numVectors='2'",
                           "<Vector action='2' obsValue='0'>1.5 -2e3 </Vector>\n<!-- the other -->"
                           "<Vector action='0' obsValue='0'> 0 \n <!-- b --> 7</Vector>\n"),
                  twoStateModel());
  EXPECT_EQ(policy.actions, (std::vector<int>{2, 0}));
  EXPECT_EQ(policy.vectors, (Eigen::Matrix2d() << 1.5, -2e3, 0, 7).finished());
  EXPECT_EQ(policy.value(Eigen::Vector2d(0.5, 0.5)), 3.5);
}

TEST(PolicyFile, TakesWhatASparseVectorLeavesOutForZero) {
  const auto policy = parsePolicy(twoStates("<SparseVector action='1' obsValue='0'>"
                                            "<Entry>1 -4.5</Entry></SparseVector>"
                                            "<SparseVector action='0'></SparseVector>"),
                                  twoStateModel());
  EXPECT_EQ(policy.vectors, (Eigen::Matrix2d() << 0, -4.5, 0, 0).finished());
}

TEST(PolicyFile, WidensTheVectorsOfAnObservedValueToAllStates) {
  const auto policy = parsePolicy(document("vectorLength='3' numObsValue='2' numVectors='2'",
                                           "<Vector action='0' obsValue='0'>1 2 3</Vector>"
                                           "<Vector action='1' obsValue='1'>4 5 6</Vector>"),
                                  mixedModel());
  Eigen::MatrixXd expected(2, 6);
  expected << 1, 2, 3, FORBIDDEN, FORBIDDEN, FORBIDDEN, FORBIDDEN, FORBIDDEN, FORBIDDEN, 4, 5, 6;
  EXPECT_EQ(policy.vectors, expected);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(6);
  right << 0, 0, 0, 0.5, 0, 0.5;
  EXPECT_EQ(policy.value(right), 5.0);
  EXPECT_EQ(policy.actions[static_cast<size_t>(policy.best(right))], 1);
}

TEST(PolicyFile, WidensWhereTheObservedVariableComesSecond) {
  PomdpTables tables = testing::blankTables(6, 2, 2, 0.9);
  tables.states = {"u/l", "u/r", "m/l", "m/r", "d/l", "d/r"};
  for (int a = 0; a < 2; ++a) {
    tables.T[static_cast<size_t>(a)].setConstant(1.0 / 6.0);
    for (int s = 0; s < 6; ++s) tables.O[static_cast<size_t>(a)](s, s % 2) = 1.0;
  }
  const auto policy = parsePolicy(document("vectorLength='3' numObsValue='2'",
                                           "<Vector action='0' obsValue='0'>1 2 3</Vector>"
                                           "<Vector action='1' obsValue='1'>4 5 6</Vector>"),
                                  Pomdp(tables));
  const Eigen::RowVectorXd first = policy.vectors.row(0);
  EXPECT_EQ(first(0), 1.0);
  EXPECT_EQ(first(2), 2.0);
  EXPECT_EQ(first(4), 3.0);
  EXPECT_EQ(first(1), FORBIDDEN);
}

TEST(PolicyFile, RefusesObservedValuesTheModelCannotTell) {
  const auto text = document("vectorLength='3' numObsValue='2'", "<Vector action='0'/>");
  const auto model = mixedModel({"a", "b", "c", "d", "e", "f"});
  EXPECT_EQ(refusal([&] { parsePolicy(text, model); }),
            "line 3: vectors of 3 numbers for each of 2 observed values do not fit the 6 states of "
            "test");
  const auto half = document("vectorLength='3' numObsValue='2'",
                             "<Vector action='0' obsValue='1'>1 2 3</Vector>");
  EXPECT_EQ(refusal([&] { parsePolicy(half, mixedModel()); }), "line 3: no vector has obsValue 0");
}

TEST(PolicyFile, RefusesWhatDoesNotFitTheModelNamingThePlace) {
  EXPECT_EQ(refusalOf(twoStates("<Vector action='3' obsValue='0'>1 2</Vector>")),
            "line 4: <Vector>: action='3' is not in 0..2");
  EXPECT_EQ(refusalOf(twoStates("<Vector action='0' obsValue='1'>1 2</Vector>")),
            "line 4: <Vector>: obsValue='1' is not in 0..0");
  EXPECT_EQ(refusalOf(twoStates("<Vector action='0' obsValue='0'>1 2\n3</Vector>")),
            "line 4: vector 0 has 3 numbers, expected 2");
  EXPECT_EQ(refusalOf(twoStates("<Vector action='0' obsValue='0'>1 x</Vector>")),
            "line 4: vector 0 state s1: 'x' is not a number");
  EXPECT_EQ(refusalOf(twoStates("\n<Vector action='0' obsValue='0'>nan 1</Vector>")),
            "line 5: vector 0 state s0: 'nan' is NaN");
  EXPECT_EQ(refusalOf(twoStates("<SparseVector action='0'><Entry>2 1</Entry></SparseVector>")),
            "line 4: vector 0: <Entry> needs an index below 2 and a number");
  EXPECT_EQ(refusalOf(twoStates("<Plane action='0'>1 2</Plane>")),
            "line 4: unknown <Plane> in <AlphaVector>");
}

TEST(PolicyFile, RefusesDocumentsThatAreNoVectors) {
  EXPECT_EQ(refusalOf(twoStates("")), "line 3: <AlphaVector> has no vector");
  EXPECT_EQ(refusalOf("<pomdpx/>"), "line 1: <pomdpx> instead of <Policy>");
  EXPECT_EQ(refusalOf("<Policy type='graph'/>"),
            "line 1: Policy type 'graph' is not supported, only value");
  EXPECT_EQ(
      refusalOf(document("vectorLength='2' numVectors='2'", "<Vector action='0'>1 2</Vector>")),
      "line 3: numVectors='2', but there are 1");
  EXPECT_EQ(refusalOf(document("vectorLength='5'", "<Vector action='0'>1 2</Vector>")),
            "line 3: vectors of 5 numbers for each of 1 observed values do not fit the 2 states of "
            "test");
}

class SavedPolicy : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  std::string path_ = ::testing::TempDir() + "saved.policy";
};

TEST_F(SavedPolicy, ReadsBackToTheLastDigit) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 1e3);
  const auto model = testing::randomPomdp(random, 7, 4, 2, 0.95);
  AlphaVectors policy;
  policy.vectors.resize(9, 7);
  for (Eigen::Index i = 0; i < policy.vectors.size(); ++i) policy.vectors(i) = normal(random);
  policy.vectors(3) = FORBIDDEN;
  policy.vectors(4) = std::numeric_limits<double>::denorm_min();
  for (int k = 0; k < 9; ++k) policy.actions.push_back(k % 4);
  savePolicy(policy, *model, path_);
  const auto again = loadPolicy(path_, *model);
  EXPECT_EQ(again.vectors, policy.vectors);
  EXPECT_EQ(again.actions, policy.actions);
}

TEST_F(SavedPolicy, IsNotWrittenWhenItDoesNotFitTheModel) {
  const auto model = twoStateModel();
  const auto refused = [&](const Eigen::MatrixXd& vectors, std::vector<int> actions) {
    return refusal([&] { savePolicy({vectors, std::move(actions)}, model, path_); });
  };
  const Eigen::RowVector2d row(1.0, 2.0);
  EXPECT_EQ(refused(row, {0, 1}), path_ + ": 1 vectors for 2 actions");
  EXPECT_EQ(refused(row, {3}), path_ + ": vector 0: action 3 is not in 0..2");
  EXPECT_EQ(refused(Eigen::RowVector3d(1, 2, 3), {0}),
            path_ + ": vectors of 3 numbers for the 2 states of test");
  EXPECT_EQ(refused(Eigen::RowVector2d(1, std::nan("")), {0}),
            path_ + ": vector 0 state s1 is NaN");
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace fabric::planner
