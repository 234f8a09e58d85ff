// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "fabric_planner/pomdpx.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::refusal;

/// The parts of a small well-formed file; a test replaces some of them.
struct Parts {
  std::string discount = "<Discount>0.9</Discount>";
  std::string states =
      "<StateVar vnamePrev='s0' vnameCurr='s1' fullyObs='false'>"
      "<ValueEnum>dry wet</ValueEnum></StateVar>";
  std::string observations = "<ObsVar vname='o'><ValueEnum>sun rain</ValueEnum></ObsVar>";
  std::string actions = "<ActionVar vname='a'><ValueEnum>stay go</ValueEnum></ActionVar>";
  std::string initial = "<Entry><Instance>-</Instance><ProbTable>0.25 0.75</ProbTable></Entry>";
  std::string transition =
      "<Entry><Instance>stay - -</Instance><ProbTable>0.9 0.1 0.2 0.8</ProbTable></Entry>"
      "<Entry><Instance>go * -</Instance><ProbTable>uniform</ProbTable></Entry>";
  std::string observation =
      "<Entry><Instance>* - -</Instance><ProbTable>0.7 0.3 0.4 0.6</ProbTable></Entry>";
  std::string reward_parents = "a s1";
  std::string reward = "<Entry><Instance>go wet</Instance><ValueTable>-5</ValueTable></Entry>";
  std::string extra;

  [[nodiscard]] static std::string function(const std::string& section, const std::string& kind,
                                            const std::string& var, const std::string& parents,
                                            const std::string& entries) {
    return "<" + section + "><" + kind + "><Var>" + var + "</Var><Parent>" + parents +
           "</Parent><Parameter type='TBL'>\n" + entries + "\n</Parameter></" + kind + "></" +
           section + ">\n";
  }

  [[nodiscard]] std::string text() const {
    std::string all = "<?xml version='1.0'?>\n<pomdpx>\n" + discount + "\n<Variable>" + states +
                      observations + actions + "<RewardVar vname='r'/></Variable>\n";
    all += function("InitialStateBelief", "CondProb", "s0", "null", initial);
    all += function("StateTransitionFunction", "CondProb", "s1", "a s0", transition);
    if (!observation.empty()) all += function("ObsFunction", "CondProb", "o", "a s1", observation);
    return all + function("RewardFunction", "Func", "r", reward_parents, reward) + extra +
           "</pomdpx>\n";
  }
};

class Pomdpx : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Pomdp load(const std::string& text, bool normalise = false) {
    std::ofstream(path()) << text;
    return loadPomdpx(path(), normalise);
  }
  Pomdp load(const Parts& parts, bool normalise = false) { return load(parts.text(), normalise); }
  /// The refusal without the path, which it must begin with.
  std::string refusalOf(const std::string& text) {
    const std::string message = refusal([&] { load(text); });
    const std::string start = path() + ": ";
    EXPECT_EQ(message.substr(0, start.size()), start);
    return message.size() < start.size() ? message : message.substr(start.size());
  }
  std::string refusalOf(const Parts& parts) { return refusalOf(parts.text()); }
  [[nodiscard]] std::string path() const { return (folder_ / "rain.pomdpx").string(); }

  std::filesystem::path folder_;
};

void expectContains(const std::string& whole, const std::string& part) {
  EXPECT_NE(whole.find(part), std::string::npos) << "'" << whole << "' has no '" << part << "'";
}

TEST_F(Pomdpx, ReadsASmallModel) {
  const auto m = load(Parts{});
  EXPECT_EQ(m.name(), "rain");
  EXPECT_EQ(m.states(), (std::vector<std::string>{"dry", "wet"}));
  EXPECT_EQ(m.observations(), (std::vector<std::string>{"sun", "rain"}));
  EXPECT_EQ(m.discount(), 0.9);
  EXPECT_EQ(m.initialBelief()(1), 0.75);
  EXPECT_EQ(m.T(0).coeff(1, 0), 0.2);
  EXPECT_EQ(m.T(1).coeff(0, 1), 0.5);
  EXPECT_EQ(m.O(1).coeff(1, 1), 0.6);
  EXPECT_FALSE(m.fullyObservable());
}

TEST_F(Pomdpx, KeepsTheExpectationOfARewardOverTheNextState) {
  const auto m = load(Parts{});
  EXPECT_DOUBLE_EQ(m.R()(1, 0), -2.5);
  EXPECT_EQ(m.R()(0, 0), 0.0);
}

TEST_F(Pomdpx, KeepsTheExpectationOfARewardOverTheObservation) {
  Parts parts;
  parts.reward_parents = "a s0 s1 o";
  parts.reward =
      "<Entry><Instance>stay dry wet rain</Instance><ValueTable>10</ValueTable></Entry>"
      "<Entry><Instance>stay wet * -</Instance><ValueTable>1 2</ValueTable></Entry>";
  const auto m = load(parts);
  EXPECT_DOUBLE_EQ(m.R()(0, 0), 0.1 * 0.6 * 10.0);
  EXPECT_DOUBLE_EQ(m.R()(0, 1), 0.2 * (0.7 * 1 + 0.3 * 2) + 0.8 * (0.4 * 1 + 0.6 * 2));
}

TEST_F(Pomdpx, AddsSeveralRewardFunctions) {
  Parts parts;
  parts.extra = "";
  auto text = parts.text();
  const std::string more =
      "<Func><Var>r</Var><Parent>null</Parent><Parameter><Entry><Instance></Instance>"
      "<ValueTable>1</ValueTable></Entry></Parameter></Func></RewardFunction>";
  text.replace(text.find("</RewardFunction>"), std::string("</RewardFunction>").size(), more);
  EXPECT_DOUBLE_EQ(load(text).R()(1, 0), -1.5);
}

TEST_F(Pomdpx, LetsLaterEntriesOverrideEarlierOnesEitherWayRound) {
  Parts parts;
  parts.reward_parents = "a s0";
  parts.reward =
      "<Entry><Instance>go *</Instance><ValueTable>-3</ValueTable></Entry>"
      "<Entry><Instance>go wet</Instance><ValueTable>1</ValueTable></Entry>"
      "<Entry><Instance>stay wet</Instance><ValueTable>1</ValueTable></Entry>"
      "<Entry><Instance>stay *</Instance><ValueTable>-3</ValueTable></Entry>";
  const auto m = load(parts);
  EXPECT_EQ(m.R()(1, 0), -3.0);
  EXPECT_EQ(m.R()(1, 1), 1.0);
  EXPECT_EQ(m.R()(0, 1), -3.0);
}

TEST_F(Pomdpx, ReadsIdentityThenOverridesOneRow) {
  Parts parts;
  parts.transition =
      "<Entry><Instance>* - -</Instance><ProbTable>identity</ProbTable></Entry>"
      "<Entry><Instance>go dry -</Instance><ProbTable>0.5 0.5</ProbTable></Entry>";
  const auto m = load(parts);
  EXPECT_TRUE(m.T(0).toDense().isIdentity(0.0));
  EXPECT_EQ(m.T(1).coeff(0, 0), 0.5);
  EXPECT_EQ(m.T(1).coeff(1, 1), 1.0);
}

TEST_F(Pomdpx, IgnoresCommentsAndTrailingBlanks) {
  Parts parts;
  parts.transition =
      "<!-- first --><Entry><Instance>stay - - \t</Instance>"
      "<ProbTable>0.9 0.1 <!-- wet --> 0.2 0.8\n </ProbTable></Entry><!--<Entry></Entry>-->"
      "<Entry><Instance> go * -</Instance><ProbTable>uniform</ProbTable></Entry>";
  EXPECT_EQ(load(parts).T(0).coeff(1, 1), 0.8);
}

TEST_F(Pomdpx, NamesValuesThatAreOnlyCounted) {
  Parts parts;
  parts.states = "<StateVar vnamePrev='s0' vnameCurr='s1'><NumValues>2</NumValues></StateVar>";
  parts.reward = "<Entry><Instance>go s1</Instance><ValueTable>-5</ValueTable></Entry>";
  EXPECT_EQ(load(parts).states(), (std::vector<std::string>{"s0", "s1"}));
}

TEST_F(Pomdpx, ObservesTheStateItselfWhenItIsFullyObserved) {
  Parts parts;
  parts.states.replace(parts.states.find("false"), 5, "true");
  parts.observations.clear();
  parts.observation.clear();
  const auto m = load(parts);
  EXPECT_TRUE(m.fullyObservable());
  EXPECT_EQ(m.observations(), m.states());
  EXPECT_TRUE(m.O(1).toDense().isIdentity(0.0));
}

TEST_F(Pomdpx, MultipliesSeveralVariablesOut) {
  const std::string text =
      "<pomdpx><Discount>0.5</Discount><Variable>"
      "<StateVar vnamePrev='x0' vnameCurr='x1' fullyObs='true'><ValueEnum>l r</ValueEnum>"
      "</StateVar><StateVar vnamePrev='y0' vnameCurr='y1'><ValueEnum>u d</ValueEnum></StateVar>"
      "<ObsVar vname='o'><ValueEnum>beep quiet</ValueEnum></ObsVar>"
      "<ActionVar vname='a'><ValueEnum>wait</ValueEnum></ActionVar><RewardVar vname='r'/>"
      "</Variable><InitialStateBelief>"
      "<CondProb><Var>x0</Var><Parent>null</Parent><Parameter><Entry><Instance>-</Instance>"
      "<ProbTable>1 0</ProbTable></Entry></Parameter></CondProb>"
      "<CondProb><Var>y0</Var><Parent>x0</Parent><Parameter><Entry><Instance>* -</Instance>"
      "<ProbTable>0.3 0.7</ProbTable></Entry></Parameter></CondProb></InitialStateBelief>"
      "<StateTransitionFunction>"
      "<CondProb><Var>x1</Var><Parent>a x0</Parent><Parameter><Entry><Instance>* - -</Instance>"
      "<ProbTable>0.8 0.2 0 1</ProbTable></Entry></Parameter></CondProb>"
      "<CondProb><Var>y1</Var><Parent>x1 y0</Parent><Parameter><Entry><Instance>l - -</Instance>"
      "<ProbTable>identity</ProbTable></Entry><Entry><Instance>r * -</Instance>"
      "<ProbTable>uniform</ProbTable></Entry></Parameter></CondProb></StateTransitionFunction>"
      "<ObsFunction><CondProb><Var>o</Var><Parent>y1</Parent><Parameter>"
      "<Entry><Instance>- -</Instance><ProbTable>0.9 0.1 0.2 0.8</ProbTable></Entry>"
      "</Parameter></CondProb></ObsFunction>"
      "<RewardFunction><Func><Var>r</Var><Parent>x0 y0</Parent><Parameter>"
      "<Entry><Instance>l -</Instance><ValueTable>1 2</ValueTable></Entry>"
      "</Parameter></Func></RewardFunction></pomdpx>";
  const auto m = load(text);
  EXPECT_EQ(m.states(), (std::vector<std::string>{"l/u", "l/d", "r/u", "r/d"}));
  EXPECT_EQ(m.observations(), (std::vector<std::string>{"beep/l", "beep/r", "quiet/l", "quiet/r"}));
  EXPECT_TRUE(m.initialBelief().isApprox(Eigen::Vector4d(0.3, 0.7, 0.0, 0.0)));
  EXPECT_TRUE(m.T(0).toDense().row(0).isApprox(Eigen::RowVector4d(0.8, 0.0, 0.1, 0.1)));
  EXPECT_TRUE(m.O(0).toDense().row(2).isApprox(Eigen::RowVector4d(0.0, 0.9, 0.0, 0.1)));
  EXPECT_EQ(m.R()(0, 1), 2.0);
}

TEST_F(Pomdpx, RefusesATokenThatIsNoNumberNamingLineElementRowAndToken) {
  Parts parts;
  parts.transition.replace(parts.transition.find("0.8"), 3, "0s");
  EXPECT_EQ(refusalOf(parts),
            "line 9: StateTransitionFunction: T[stay] row wet: '0s' is not a number");
}

TEST_F(Pomdpx, RefusesNanAndInfinityByName) {
  Parts parts;
  parts.transition.replace(parts.transition.find("0.8"), 3, "nan");
  expectContains(refusalOf(parts), "T[stay] row wet: 'nan' is NaN");
  parts = Parts{};
  parts.reward.replace(parts.reward.find("-5"), 2, "inf");
  expectContains(refusalOf(parts), "RewardFunction: R[go] row wet: 'inf' is infinite");
}

TEST_F(Pomdpx, RefusesARowThatDoesNotSumToOneUnlessAskedToNormalise) {
  Parts parts;
  parts.transition.replace(parts.transition.find("0.8"), 3, "0.83");
  expectContains(refusalOf(parts), "StateTransitionFunction: T[stay] row wet sums to 1.03, not 1");
  EXPECT_NEAR(load(parts, true).T(0).coeff(1, 1), 0.83 / 1.03, 1e-15);
}

TEST_F(Pomdpx, RefusesARowWithoutEntry) {
  Parts parts;
  parts.transition.erase(parts.transition.find("<Entry><Instance>go"));
  expectContains(refusalOf(parts), "T[go] row dry has no entry");
}

TEST_F(Pomdpx, RefusesUnknownNames) {
  Parts parts;
  parts.reward.replace(parts.reward.find("wet"), 3, "hot");
  expectContains(refusalOf(parts), "R: instance 'go hot': 'hot' is no value of s1 (dry, wet)");
  parts = Parts{};
  parts.reward_parents = "a weather";
  expectContains(refusalOf(parts), "unknown variable 'weather'");
  parts = Parts{};
  parts.extra = "<Weather/>";
  expectContains(refusalOf(parts), "unknown <Weather>");
}

TEST_F(Pomdpx, AcceptsADuplicateButRefusesAConflict) {
  Parts parts;
  parts.reward += parts.reward;
  EXPECT_DOUBLE_EQ(load(parts).R()(1, 0), -2.5);
  parts.reward += "<Entry><Instance>go wet</Instance><ValueTable>-4</ValueTable></Entry>";
  expectContains(refusalOf(parts),
                 "R[go] row wet: entry 'go wet' is given twice with different values");
}

TEST_F(Pomdpx, RefusesTheWrongCountOfNumbers) {
  Parts parts;
  parts.initial = "<Entry><Instance>-</Instance><ProbTable>1 0 0</ProbTable></Entry>";
  expectContains(refusalOf(parts), "b: entry '-' has 3 numbers, expected 2");
}

TEST_F(Pomdpx, RefusesWhatIsNotWellFormedNamingTheLine) {
  auto text = Parts{}.text();
  text.replace(text.find("</Variable>"), 11, "</Varable>");
  expectContains(refusalOf(text), "line 4: not well-formed XML");
  Parts parts;
  parts.reward += "\n<!-- <Entry> -> <!-- </Entry> -->";
  expectContains(refusalOf(parts), "not well-formed XML ('--' inside a comment)");
}

TEST_F(Pomdpx, RefusesMissingPartsByName) {
  Parts parts;
  parts.discount.clear();
  expectContains(refusalOf(parts), "<pomdpx> has no <Discount>");
  parts = Parts{};
  parts.observation.clear();
  expectContains(refusalOf(parts), "<pomdpx> has no <ObsFunction>");
  parts = Parts{};
  parts.observations.clear();
  parts.observation.clear();
  expectContains(refusalOf(parts), "no ObsVar");
}

TEST_F(Pomdpx, RefusesValuesAndVariablesNamedTwice) {
  Parts parts;
  parts.states.replace(parts.states.find("dry wet"), 7, "dry dry");
  expectContains(refusalOf(parts), "s1: 'dry' is named twice");
  parts = Parts{};
  parts.observations.replace(parts.observations.find("vname='o'"), 9, "vname='a'");
  expectContains(refusalOf(parts), "variable 'a' is named twice");
}

TEST_F(Pomdpx, RefusesFilesThatAreNone) {
  EXPECT_EQ(refusal([&] { loadPomdpx(folder_.string()); }), folder_.string() + ": no such file");
  std::ofstream(path()) << "";
  expectContains(refusal([&] { loadPomdpx(path()); }), "not well-formed XML");
}

TEST_F(Pomdpx, ReadsBackWhatItWroteToTheLastDigit) {
  std::mt19937 random(31);
  for (int i = 0; i < 10; ++i) {
    const auto m = testing::randomPomdp(random, 4, 3, 5, 0.97, 0.3);
    savePomdpx(*m, path());
    const auto again = loadPomdpx(path());
    EXPECT_EQ(again.observations(), m->observations());
    EXPECT_EQ(again.initialBelief(), m->initialBelief());
    EXPECT_EQ(again.R(), m->R());
    for (int a = 0; a < 3; ++a)
      EXPECT_TRUE(again.T(a).toDense() == m->T(a).toDense() &&
                  again.O(a).toDense() == m->O(a).toDense());
  }
}

TEST_F(Pomdpx, WritesAnMdpWithoutObservationVariable) {
  Parts parts;
  parts.states.replace(parts.states.find("false"), 5, "true");
  parts.observations.clear();
  parts.observation.clear();
  savePomdpx(load(parts), path());
  EXPECT_TRUE(loadPomdpx(path()).fullyObservable());
}

}  // namespace
}  // namespace fabric::planner
