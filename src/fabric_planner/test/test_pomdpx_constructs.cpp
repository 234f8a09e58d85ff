// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "fabric_planner/pomdpx.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::refusal;
using Names = std::vector<std::string>;

std::string tag(const std::string& name, const std::string& content,
                const std::string& attributes = "") {
  return "<" + name + attributes + ">" + content + "</" + name + ">\n";
}

std::string parameter(const std::string& type, const std::string& content) {
  return tag("Parameter", content, " type='" + type + "'");
}

std::string entry(const std::string& instance, const std::string& numbers,
                  const std::string& table = "ProbTable") {
  return tag("Entry", tag("Instance", instance) + tag(table, numbers));
}

std::string conditional(const std::string& var, const std::string& parents,
                        const std::string& parameter) {
  return tag("CondProb", tag("Var", var) + tag("Parent", parents) + parameter);
}

std::string node(const std::string& var, const std::string& edges) {
  return tag("Node", edges, " var='" + var + "'");
}
std::string edge(const std::string& val, const std::string& below) {
  return tag("Edge", below, " val='" + val + "'");
}
std::string terminal(const std::string& number) { return tag("Terminal", number); }
std::string sub(const std::string& type, const std::string& rest) {
  return "<SubDAG type='" + type + "' " + rest + "/>";
}

/// A vehicle at one of two places drives or digs; a stone under it is good or bad.
struct Stone {
  std::string initial = conditional("at0", "null", parameter("TBL", entry("-", "1 0"))) +
                        conditional("stone0", "null", parameter("TBL", entry("-", "uniform")));
  std::string drive = conditional(
      "at1", "do at0", parameter("TBL", entry("* - -", "identity") + entry("drive * -", "0 1")));
  std::string stone =
      conditional("stone1", "do at0 stone0",
                  parameter("TBL", entry("* * - -", "identity") + entry("dig here * -", "0 1")));
  std::string seen = conditional(
      "see", "do at1 stone1",
      parameter("TBL", entry("* * * -", "1 0") + entry("dig * - -", "0.9 0.1 0.2 0.8")));
  std::string reward = parameter(
      "TBL", entry("* * *", "-1", "ValueTable") + entry("dig here good", "10", "ValueTable"));
  std::string extra;

  [[nodiscard]] std::string text() const {
    return tag(
        "pomdpx",
        extra + tag("Discount", "0.9") +
            tag("Variable", tag("StateVar", tag("ValueEnum", "here there"),
                                " vnamePrev='at0' vnameCurr='at1' fullyObs='true'") +
                                tag("StateVar", tag("ValueEnum", "good bad"),
                                    " vnamePrev='stone0' vnameCurr='stone1'") +
                                tag("ObsVar", tag("ValueEnum", "gold dust"), " vname='see'") +
                                tag("ActionVar", tag("ValueEnum", "drive dig"), " vname='do'") +
                                "<RewardVar vname='gain'/>") +
            tag("InitialStateBelief", initial) + tag("StateTransitionFunction", drive + stone) +
            tag("ObsFunction", seen) +
            tag("RewardFunction",
                tag("Func", tag("Var", "gain") + tag("Parent", "do at0 stone0") + reward)),
        " version='1.0' id='stone'");
  }
  [[nodiscard]] Pomdp model() const { return parsePomdpx(text(), "stone"); }
  [[nodiscard]] std::string refused() const {
    return refusal([&] { (void)model(); });
  }
};

void expectEqual(const Pomdp& x, const Pomdp& y) {
  EXPECT_EQ(x.states(), y.states());
  EXPECT_EQ(x.actions(), y.actions());
  EXPECT_EQ(x.observations(), y.observations());
  EXPECT_EQ(x.discount(), y.discount());
  EXPECT_EQ(x.initialBelief(), y.initialBelief());
  EXPECT_EQ(x.R(), y.R());
  for (int a = 0; a < x.numActions(); ++a) {
    EXPECT_EQ(x.T(a).toDense(), y.T(a).toDense());
    EXPECT_EQ(x.O(a).toDense(), y.O(a).toDense());
  }
}

void expectContains(const std::string& whole, const std::string& part) {
  EXPECT_NE(whole.find(part), std::string::npos) << "'" << whole << "' has no '" << part << "'";
}

Stone diagrams() {
  Stone dd;
  const auto dag = [](const std::string& content) { return parameter("DD", tag("DAG", content)); };
  dd.drive =
      conditional("at1", "do at0",
                  dag(node("do", edge("drive", sub("deterministic", "var='at1' val='there'")) +
                                     edge("dig", sub("persistent", "var='at1'")))));
  dd.stone = conditional(
      "stone1", "do at0 stone0",
      dag(node("do",
               edge("drive", sub("persistent", "var='stone1'")) +
                   edge("dig", node("at0", edge("there", sub("persistent", "var='stone1'")) +
                                               edge("here", sub("deterministic",
                                                                "var='stone1' val='bad'")))))));
  const auto told = [](const std::string& gold, const std::string& dust) {
    return node("see", edge("gold", terminal(gold)) + edge("dust", terminal(dust)));
  };
  dd.seen = conditional(
      "see", "do at1 stone1",
      parameter("DD",
                tag("DAG", node("do", edge("drive", sub("deterministic", "var='see' val='gold'")) +
                                          edge("dig", sub("template", "idref='look'")))) +
                    tag("SubDAGTemplate",
                        node("stone1",
                             edge("good", told("0.9", "0.1")) + edge("bad", told("0.2", "0.8"))),
                        " id='look'")));
  dd.reward = dag(node(
      "do", edge("drive", terminal("-1")) +
                edge("dig", node("at0", edge("there", terminal("-1")) +
                                            edge("here", node("stone0",
                                                              edge("good", terminal("10")) +
                                                                  edge("bad", terminal("-1"))))))));
  return dd;
}

TEST(PomdpxConstructs, SayTheSameAsTablesAndAsDecisionDiagrams) {
  const auto tables = Stone{}.model();
  EXPECT_EQ(tables.states(), (Names{"here/good", "here/bad", "there/good", "there/bad"}));
  EXPECT_EQ(tables.T(1).coeff(0, 1), 1.0);
  EXPECT_EQ(tables.R()(1, 0), 10.0);
  expectEqual(diagrams().model(), tables);
}

TEST(PomdpxConstructs, LetADiagramGiveTheJointBeliefOfSeveralVariables) {
  Stone joint;
  const std::string diagram =
      parameter("DD", tag("DAG", node("at0", edge("here", sub("uniform", "var='stone0'")) +
                                                 edge("there", terminal("0")))));
  joint.initial = conditional("at0 stone0", "null", diagram);
  expectEqual(joint.model(), Stone{}.model());
  joint.initial = conditional("at0", "null", diagram);
  expectEqual(joint.model(), Stone{}.model());
  joint.initial = conditional("at0 stone0", "null", parameter("TBL", entry("- -", ".5 .5 0 0")));
  expectEqual(joint.model(), Stone{}.model());
  joint.initial = conditional("at0 stone0", "null", parameter("TBL", entry("- -", ".5 .5 0 .1")));
  expectContains(joint.refused(), "InitialStateBelief: b sums to 1.1, not 1");
}

TEST(PomdpxConstructs, TakeValuesByNumberWhereNoValueHasThatName) {
  Stone numbered;
  numbered.reward =
      parameter("TBL", entry("* * *", "-1", "ValueTable") + entry("1 0 0", "10", "ValueTable"));
  expectEqual(numbered.model(), Stone{}.model());
  numbered.reward = parameter("TBL", entry("2 0 0", "10", "ValueTable"));
  expectContains(numbered.refused(), "'2' is no value of do (drive, dig)");
}

TEST(PomdpxConstructs, MayComeInSeveralSectionsOfOneName) {
  Stone split;
  split.drive += "</StateTransitionFunction><StateTransitionFunction>";
  expectEqual(split.model(), Stone{}.model());
}

TEST(PomdpxConstructs, KnowNoFiniteHorizon) {
  Stone stone;
  stone.extra = tag("Description", "any <b>text</b>") + tag("Horizon", "infinite");
  expectEqual(stone.model(), Stone{}.model());
  stone.extra = tag("Horizon", "12");
  EXPECT_EQ(stone.refused(),
            "line 1: Horizon '12': only models that go on for ever (infinite) are read");
}

TEST(PomdpxConstructs, RefuseDiagramsThatAreNotWhole) {
  const auto refused = [](const std::string& content) {
    Stone stone;
    stone.drive = conditional("at1", "do at0", parameter("DD", content));
    return stone.refused();
  };
  const auto dag = [&](const std::string& content) { return refused(tag("DAG", content)); };
  expectContains(dag(""), "<DAG> needs exactly one <Node>, <SubDAG> or <Terminal>");
  expectContains(refused(""), "<Parameter> has no <DAG>");
  expectContains(dag(terminal("1") + terminal("1")), "<DAG> needs exactly one");
  expectContains(dag(terminal("x")), "'x' is not a number");
  expectContains(dag(terminal("inf")), "'inf' is infinite");
  expectContains(dag(node("sky", "")), "<Node>: 'sky' is neither Var nor Parent here");
  expectContains(dag(node("at1", edge("up", terminal("1")))),
                 "<Edge>: 'up' is no value of at1 (here, there)");
  expectContains(dag(node("at1", edge("here", terminal("1")) + edge("0", terminal("1")))),
                 "a second edge for '0'");
  expectContains(dag(sub("random", "var='at1'")), "SubDAG type 'random' is none of");
  expectContains(dag(sub("template", "idref='x'")), "no SubDAGTemplate 'x'");
  expectContains(dag(sub("persistent", "var='at0'")),
                 "persistent: 'at0' is no state variable after the step");
  expectContains(dag(sub("deterministic", "var='at1'")), "needs val=");
  expectContains(dag(node("do", edge("dig", sub("uniform", "var='at1'")))),
                 "T[drive] row here has no entry");
  expectContains(dag(terminal("0.7")), "T[drive] row here sums to 1.4, not 1");
  expectContains(refused(tag("DAG", sub("template", "idref='x'")) +
                         tag("SubDAGTemplate", sub("template", "idref='x'"), " id='x'")),
                 "template 'x' is inside itself");
}

TEST(PomdpxConstructs, RefuseParametersAndVariablesTheyDoNotKnow) {
  Stone stone;
  stone.drive = conditional("at1", "do at0", parameter("CONT", ""));
  expectContains(stone.refused(), "Parameter type 'CONT' is not supported, only TBL and DD");
  stone = Stone{};
  stone.drive = conditional("at1", "do do at0", parameter("TBL", ""));
  expectContains(stone.refused(), "variable 'do' is named twice");
  stone = Stone{};
  stone.drive = conditional("", "do at0", parameter("TBL", ""));
  expectContains(stone.refused(), "<Var> names no variable");
}

TEST(PomdpxConstructs, RefuseVariablesThatDependOnEachOtherInACircle) {
  Stone stone;
  stone.drive = conditional("at1", "stone1", parameter("TBL", entry("- -", "identity")));
  stone.stone = conditional("stone1", "at1", parameter("TBL", entry("- -", "identity")));
  expectContains(stone.refused(), "the variable 'at1' depends on itself by way of its parents");
}

TEST(PomdpxConstructs, StayWithinTheLimitsOfTheReader) {
  FileLimits limits;
  limits.values = 3;
  EXPECT_EQ(refusal([&] { parsePomdpx(Stone{}.text(), "stone", false, limits); }),
            "4 combinations of values are too many (at most 3)");
  limits = FileLimits{};
  limits.entries = 8;
  expectContains(refusal([&] { parsePomdpx(Stone{}.text(), "stone", false, limits); }),
                 "table too large");
  const std::string nul = "<pomdpx>\n" + std::string(1, '\0') + "</pomdpx>";
  EXPECT_EQ(refusal([&] { parsePomdpx(nul, "stone"); }),
            "line 2: not well-formed XML (a byte that is 0)");
}

class SavedPomdpx : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  void expectLossless(const Pomdp& model) {
    savePomdpx(model, path_);
    expectEqual(loadPomdpx(path_), model);
  }
  std::string path_ = ::testing::TempDir() + "saved.pomdpx";
};

TEST_F(SavedPomdpx, ReadsBackALargeSparseModelToTheLastDigit) {
  std::mt19937 random(7);
  PomdpTables tables = testing::randomTables(random, 150, 3, 60, 0.97, 0.97);
  tables.T[1] = Eigen::MatrixXd::Identity(150, 150);
  tables.O[2].setConstant(1.0 / 60.0);
  expectLossless(Pomdp(tables));
  EXPECT_LT(std::filesystem::file_size(path_), 700000U);
}

TEST_F(SavedPomdpx, ReadsBackFlattenedAndOddNames) {
  expectLossless(Stone{}.model());
  PomdpTables tables = testing::blankTables(2, 2, 2, 1.0);
  tables.states = {"a<b&\"c'", "\xC3\xA9t\xC3\xA9"};
  tables.actions = {"1", "0"};
  tables.observations = {"null", "uniform"};
  for (auto& T : tables.T) T.setIdentity();
  for (auto& O : tables.O) O.setConstant(0.5);
  tables.R << -1.25e-300, 1e300, 0.1, 1.0 / 3.0;
  expectLossless(Pomdp(tables));
}

TEST_F(SavedPomdpx, IsNotWrittenWhereTheFormatHasNoPlaceForIt) {
  PomdpTables tables = testing::blankTables(2, 2, 1, 0.9);
  for (auto& T : tables.T) T.setIdentity();
  for (auto& O : tables.O) O.setOnes();
  tables.allowed = Flags::Constant(2, 2, true);
  expectLossless(Pomdp(tables));
  std::filesystem::remove(path_);
  tables.allowed(0, 1) = false;
  EXPECT_EQ(refusal([&] { savePomdpx(Pomdp(tables), path_); }),
            path_ + ": POMDPX has no place for actions that are allowed in some states only");
  tables.allowed(0, 1) = true;
  tables.states[1] = "*";
  EXPECT_EQ(refusal([&] { savePomdpx(Pomdp(tables), path_); }),
            path_ + ": state '*': POMDPX has no place for such a name");
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace fabric::planner
