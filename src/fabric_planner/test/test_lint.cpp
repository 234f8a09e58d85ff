// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "fabric_planner/lint.hpp"
#include "fabric_planner/model_file.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using Names = std::vector<std::string>;

/// "try" and "wait" in "start"; trying reaches the last state with 0.8 and earns 8 there, or the
/// state before it with 0.1. Both of these are absorbing and pay nothing; waiting costs 1.
PomdpTables attempt() {
  PomdpTables tables = testing::blankTables(3, 2, 3, 0.95);
  tables.states = {"start", "broken", "reached"};
  tables.actions = {"try", "wait"};
  tables.T[0] << 0.1, 0.1, 0.8, 0, 1, 0, 0, 0, 1;
  tables.T[1].setIdentity();
  for (auto& O : tables.O) O.setIdentity();
  tables.R << 8.0 * 0.8, 0, 0, -1, 0, 0;
  return tables;
}

/// The finding of that kind; fails when there is not exactly one.
Finding only(const PomdpTables& tables, FindingKind kind) {
  std::vector<Finding> found;
  for (const auto& finding : lint(Pomdp(tables))) {
    if (finding.kind == kind) found.push_back(finding);
  }
  EXPECT_EQ(found.size(), 1U) << nameOf(kind);
  return found.empty() ? Finding{} : found[0];
}

std::string told(const std::vector<Finding>& findings) {
  std::string all;
  for (const auto& f : findings) all += nameOf(f.severity) + " " + f.sentence + "\n";
  return all;
}

bool has(const PomdpTables& tables, FindingKind kind) {
  const auto findings = lint(Pomdp(tables));
  return std::any_of(findings.begin(), findings.end(),
                     [kind](const Finding& finding) { return finding.kind == kind; });
}

TEST(Lint, FindsNothingInAModelThatEndsAsItShould) { EXPECT_EQ(told(lint(Pomdp(attempt()))), ""); }

TEST(Lint, FindsASuccessThatPaysForEverByItsStructureAlone) {
  auto tables = attempt();  // now the reward is for being there next, and it is left again
  tables.states = {"a", "b", "c"};
  for (auto& T : tables.T) T.row(2) << 0.05, 0.05, 0.9;
  for (auto& T : tables.T) T.row(1) << 0.05, 0.9, 0.05;
  tables.T[1].row(0) << 0.9, 0.05, 0.05;
  const Eigen::Vector3d arrival(0.0, -3.0, 8.0);
  for (int a = 0; a < 2; ++a) {
    tables.R.row(a) = (tables.T[static_cast<size_t>(a)] * arrival).transpose();
  }
  const auto found = only(tables, FindingKind::REWARD_REPEATS);
  EXPECT_EQ(found.places, Names{"c"});
  EXPECT_EQ(found.severity, Severity::WARNING);
  EXPECT_NE(found.sentence.find("kept by try with probability 0.9 and pays 7.05 each time"),
            std::string::npos)
      << found.sentence;
}

TEST(Lint, FindsAnAbsorbingStateThatStillPays) {
  auto tables = attempt();
  tables.R(1, 2) = 8.0;
  const auto found = only(tables, FindingKind::REWARD_REPEATS);
  EXPECT_EQ(found.places, Names{"reached"});
  EXPECT_NE(found.sentence.find("for ever"), std::string::npos);
}

TEST(Lint, LetsAProcessWithoutEndEarnWhileItRuns) {
  auto tables = testing::blankTables(2, 2, 2, 0.95);  // a machine: run it or repair it
  tables.states = {"working", "broken"};
  tables.T[0] << 0.9, 0.1, 0.0, 1.0;
  tables.T[1] << 1.0, 0.0, 1.0, 0.0;
  for (auto& O : tables.O) O.setIdentity();
  tables.R << 1.0, 0.0, -2.0, -2.0;
  EXPECT_EQ(told(lint(Pomdp(tables))), "");
}

TEST(Lint, FindsAnEndThatIsLeftAgainByItsName) {
  for (const char* name : {"GlobalSuccess", "task_done", "goal", "x/failed"}) {
    auto tables = attempt();
    tables.states[2] = name;
    EXPECT_EQ(told(lint(Pomdp(tables))), "") << name;
    tables.T[1].row(2) << 0.1, 0.0, 0.9;
    const auto found = only(tables, FindingKind::END_NOT_ABSORBING);
    EXPECT_EQ(found.places, Names{name});
    EXPECT_EQ(found.severity, Severity::WARNING);
  }
  auto tables = attempt();
  tables.states[2] = "failed_to_grasp";
  tables.T[1].row(2) << 0.1, 0.0, 0.9;
  EXPECT_FALSE(has(tables, FindingKind::END_NOT_ABSORBING));
}

TEST(Lint, FindsAnEndThatIsLeftAgainByItsStructure) {
  auto tables = attempt();
  for (auto& T : tables.T) T.row(1) << 0.1, 0.9, 0.0;
  const auto found = only(tables, FindingKind::END_NOT_ABSORBING);
  EXPECT_EQ(found.places, Names{"broken"});
  EXPECT_EQ(found.severity, Severity::INFO);
}

TEST(Lint, FindsRewardsOfOddSign) {
  auto tables = attempt();
  tables.states[1] = "failure";
  tables.R.col(1).setConstant(3.0);
  EXPECT_EQ(only(tables, FindingKind::ODD_REWARD).places, Names{"failure"});
  tables = attempt();
  tables.states[2] = "success";
  tables.R.col(2).setConstant(-3.0);
  EXPECT_EQ(only(tables, FindingKind::ODD_REWARD).places, Names{"success"});
  tables = attempt();
  tables.R = tables.R.cwiseAbs().eval();
  EXPECT_NE(only(tables, FindingKind::ODD_REWARD).sentence.find("minus sign"), std::string::npos);
  tables.R.setConstant(2.0);
  EXPECT_NE(only(tables, FindingKind::ODD_REWARD).sentence.find("every reward is 2"),
            std::string::npos);
}

TEST(Lint, CallsItAnErrorWhenNothingEndsAtDiscountOne) {
  auto tables = attempt();
  tables.discount = 1.0;
  EXPECT_FALSE(has(tables, FindingKind::ENDLESS));
  tables.R(0, 1) = -1.0;
  const auto found = only(tables, FindingKind::ENDLESS);
  EXPECT_EQ(found.severity, Severity::ERROR);
  EXPECT_EQ(found.places, Names{"broken"});
  EXPECT_EQ(lint(Pomdp(tables))[0].kind, FindingKind::ENDLESS);
}

TEST(Lint, FindsStatesThatAreNeverEntered) {
  auto tables = attempt();
  tables.T[0].row(0) << 0.2, 0.0, 0.8;
  EXPECT_EQ(only(tables, FindingKind::UNREACHABLE_STATE).places, Names{"broken"});
  tables = attempt();
  tables.allowed = Flags::Constant(2, 3, true);
  tables.allowed(0, 0) = false;
  EXPECT_EQ(only(tables, FindingKind::UNREACHABLE_STATE).places, (Names{"broken", "reached"}));
}

TEST(Lint, FindsStatesNoObservationTellsApartUnlessTheyAreEnds) {
  auto tables = attempt();
  for (auto& O : tables.O) O.row(2) = O.row(1);
  EXPECT_FALSE(has(tables, FindingKind::INDISTINGUISHABLE_STATE));
  EXPECT_EQ(only(tables, FindingKind::UNUSED_OBSERVATION).places, Names{"o2"});
  for (auto& O : tables.O) O.row(1) = O.row(0);
  tables.T[1].row(1) << 0.5, 0.5, 0.0;
  EXPECT_EQ(only(tables, FindingKind::INDISTINGUISHABLE_STATE).places, (Names{"start", "broken"}));
  tables.O[1].row(1) << 0.9, 0.1, 0.0;
  EXPECT_FALSE(has(tables, FindingKind::INDISTINGUISHABLE_STATE));
}

TEST(Lint, FindsAnActionWhoseObservationSaysNothing) {
  auto tables = attempt();
  tables.O[0].setConstant(1.0 / 3.0);
  const auto found = only(tables, FindingKind::SILENT_ACTION);
  EXPECT_EQ(found.places, Names{"try"});
  EXPECT_EQ(found.severity, Severity::INFO);
}

TEST(Lint, FindsActionsThatAreNeedless) {
  auto tables = attempt();
  tables.T[1] = tables.T[0];
  EXPECT_EQ(only(tables, FindingKind::NEVER_BEST_ACTION).places, (Names{"wait", "try"}));
  tables.R.row(1) = tables.R.row(0);
  EXPECT_EQ(only(tables, FindingKind::DUPLICATE_ACTION).places, (Names{"wait", "try"}));
  tables.O[1].setConstant(1.0 / 3.0);
  EXPECT_FALSE(has(tables, FindingKind::DUPLICATE_ACTION));
}

TEST(Lint, HasNothingGraveToSayOfTheShippedModels) {
  for (const char* name :
       {"inspection_proactive", "inspection_eager", "inspection_patient", "inspection_reactive",
        "inspection_on_call", "sorting_proactive", "sorting_eager", "sorting_patient",
        "sorting_reactive", "sorting_on_call", "none"}) {
    const auto path = std::string(PACKAGE_DIR) + "/models/" + name + ".pomdpx";
    for (const auto& finding : lint(loadModel(path))) {
      const bool known =
          finding.severity == Severity::INFO || finding.kind == FindingKind::UNREACHABLE_STATE;
      EXPECT_TRUE(known) << name << ": " << finding.sentence;
    }
  }
}

}  // namespace
}  // namespace fabric::planner
