// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "fabric_planner/pomdp_file.hpp"
#include "fabric_planner/pomdpx.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::refusal;
using Names = std::vector<std::string>;

/// Two states, two actions, two observations; a test adds the tables or takes lines away.
const std::string PREAMBLE =
    "discount: 0.95\nvalues: reward\nstates: dry wet\nactions: stay go\nobservations: sun rain\n";
const std::string TABLES = "T: * identity\nO: * uniform\n";

Pomdp parse(const std::string& text, bool normalise = false) {
  return parsePomdpFile(text, "rain", normalise);
}

void expectRefused(const std::string& text, const std::string& message) {
  EXPECT_EQ(refusal([&] { parse(text); }), message);
}

std::string without(std::string text, const std::string& part) {
  return text.erase(text.find(part), part.size());
}

TEST(PomdpFile, ReadsSingleNumbersRowsAndMatrices) {
  const auto m = parse(PREAMBLE +
                       "T: stay\n0.9 0.1\n0.2 0.8\n"
                       "T: go : dry 0.5 0.5 T: go : wet : dry 0.25 T: go:wet:wet 0.75\n"
                       "O: *\n0.7 0.3 0.4 0.6\nO: go : wet\n1 0\nR: go : dry : wet : rain -5\n");
  EXPECT_EQ(m.name(), "rain");
  EXPECT_EQ(m.states(), (Names{"dry", "wet"}));
  EXPECT_EQ(m.discount(), 0.95);
  EXPECT_TRUE(m.T(0).toDense().isApprox((Eigen::Matrix2d() << 0.9, 0.1, 0.2, 0.8).finished()));
  EXPECT_TRUE(m.T(1).toDense().isApprox((Eigen::Matrix2d() << 0.5, 0.5, 0.25, 0.75).finished()));
  EXPECT_TRUE(m.O(0).toDense().isApprox((Eigen::Matrix2d() << 0.7, 0.3, 0.4, 0.6).finished()));
  EXPECT_TRUE(m.O(1).toDense().isApprox((Eigen::Matrix2d() << 0.7, 0.3, 1.0, 0.0).finished()));
  EXPECT_EQ(m.R()(1, 0), 0.0);
}

TEST(PomdpFile, KeepsTheExpectationOfARewardOverNextStateAndObservation) {
  const auto m = parse(PREAMBLE +
                       "T: *\n0.9 0.1 0.2 0.8\nO: *\n0.7 0.3 0.4 0.6\n"
                       "R: stay : dry : wet : rain 10\n"  // single
                       "R: stay : wet : *\n1 2\n"         // row over observations
                       "R: go : dry\n1 2\n3 4\n"          // matrix over next state, observation
                       "R: go : wet : * : * -7\n");
  EXPECT_DOUBLE_EQ(m.R()(0, 0), 0.1 * 0.6 * 10.0);
  EXPECT_DOUBLE_EQ(m.R()(0, 1), 0.2 * (0.7 * 1 + 0.3 * 2) + 0.8 * (0.4 * 1 + 0.6 * 2));
  EXPECT_DOUBLE_EQ(m.R()(1, 0), 0.9 * (0.7 * 1 + 0.3 * 2) + 0.1 * (0.4 * 3 + 0.6 * 4));
  EXPECT_DOUBLE_EQ(m.R()(1, 1), -7.0);
}

TEST(PomdpFile, UnderstandsUniformIdentityResetAndTheWildcard) {
  const auto m = parse(PREAMBLE +
                       "start: 0.25 0.75\nT: stay identity\nT: go uniform\nT: go : wet reset\n"
                       "O: * : dry uniform\nO: * : wet : sun 1\n");
  EXPECT_TRUE(m.T(0).toDense().isIdentity(0.0));
  EXPECT_EQ(m.T(1).coeff(0, 1), 0.5);
  EXPECT_EQ(m.T(1).coeff(1, 1), 0.75);
  EXPECT_EQ(m.O(1).coeff(0, 0), 0.5);
  EXPECT_EQ(m.O(0).coeff(1, 0), 1.0);
}

TEST(PomdpFile, ResetsEveryRowToTheStartWhenAWholeMatrixIsReset) {
  const auto m = parse(PREAMBLE + "start: wet\nT: stay identity T: go reset\nO: * uniform\n");
  EXPECT_EQ(m.T(1).coeff(0, 1), 1.0);
  EXPECT_EQ(m.T(1).coeff(1, 1), 1.0);
}

TEST(PomdpFile, LetsWhatIsSaidLastHold) {
  const auto m = parse(PREAMBLE + TABLES +
                       "R: * : * : * : * -1\nR: go : * : * : * -3\nR: go : wet : * : * 1\n"
                       "R: stay : wet : * : * 9\nR: stay : * : * : * 2\n");
  EXPECT_TRUE(m.R().isApprox((Eigen::Matrix2d() << 2, 2, -3, 1).finished()));
}

TEST(PomdpFile, TurnsCostsIntoNegativeRewards) {
  auto text = PREAMBLE + TABLES + "R: go : * : * : * 3\n";
  text.replace(text.find("reward"), 6, "cost");
  EXPECT_EQ(parse(text).R()(1, 0), -3.0);
}

TEST(PomdpFile, CallsThingsByNumberWhereTheyAreOnlyCountedOrEvenNamed) {
  const auto m = parse(
      "discount: 0.9 values: reward states: 3 actions: 2 observations: see\n"
      "T: 0 identity T: 1 : * : 2 1.0 O: * : * : 0 1\nR: 1 : 0 : 2 : see +4\n");
  EXPECT_EQ(m.states(), (Names{"0", "1", "2"}));
  EXPECT_EQ(m.T(1).coeff(1, 2), 1.0);
  EXPECT_EQ(m.R()(1, 0), 4.0);
}

TEST(PomdpFile, IgnoresCommentsAndLineBreaksAnywhere) {
  const auto m = parse(
      "# a file\ndiscount # of the future\n:\n0.95\nvalues:reward\r\nstates:dry#one\nwet\n"
      "actions :stay go observations: sun rain\nT:*\nidentity#\nO\n:\n*\n:dry uniform\n"
      "O:* :wet : sun 1");
  EXPECT_EQ(m.states(), (Names{"dry", "wet"}));
  EXPECT_EQ(m.O(0).coeff(1, 0), 1.0);
}

TEST(PomdpFile, StartsInAnyWayTheFormatKnows) {
  const auto start = [](const std::string& line) {
    const auto m =
        parse("discount: 1\nvalues: reward\nstates: a b c d\nactions: x\nobservations: o\n" + line +
              "\nT: x identity\nO: x uniform\n");
    return Eigen::Vector4d(m.initialBelief());
  };
  EXPECT_EQ(start(""), Eigen::Vector4d(0.25, 0.25, 0.25, 0.25));
  EXPECT_EQ(start("start: uniform"), Eigen::Vector4d(0.25, 0.25, 0.25, 0.25));
  EXPECT_EQ(start("start: 0.5 0 0 0.5"), Eigen::Vector4d(0.5, 0, 0, 0.5));
  EXPECT_EQ(start("start: c"), Eigen::Vector4d(0, 0, 1, 0));
  EXPECT_EQ(start("start: 3"), Eigen::Vector4d(0, 0, 0, 1));
  EXPECT_EQ(start("start include: a 2"), Eigen::Vector4d(0.5, 0, 0.5, 0));
  EXPECT_EQ(start("start exclude: a b c"), Eigen::Vector4d(0, 0, 0, 1));
}

TEST(PomdpFile, ReadsAnMdpWithoutObservations) {
  const auto m = parse(
      "discount: 0.9\nvalues: reward\nstates: a b\nactions: x y\nT: * uniform\n"
      "R: x : a : b 4\nR: x : b\n1 2\nR: y\n1 2 3 4\n");
  EXPECT_TRUE(m.fullyObservable());
  EXPECT_EQ(m.observations(), m.states());
  EXPECT_TRUE(m.R().isApprox((Eigen::Matrix2d() << 2, 1.5, 1.5, 3.5).finished()));
}

TEST(PomdpFile, RefusesTokensNamingLineElementRowAndToken) {
  expectRefused(PREAMBLE + "T: stay\n1 0\n0s 1\n", "line 8: T[stay] row wet: '0s' is not a number");
  expectRefused(PREAMBLE + "T: * : dry nan 1\n", "line 6: T[*] row dry: 'nan' is NaN");
  expectRefused(PREAMBLE + "R: go : dry : * : sun inf",
                "line 6: R[go] row dry/*/sun: 'inf' is infinite");
  expectRefused(PREAMBLE + "T: jump identity", "line 6: T: 'jump' is no action");
  expectRefused(PREAMBLE + "O: go : wet : fog 1", "line 6: O: 'fog' is no observation");
  expectRefused(PREAMBLE + "T: go : 2 : 0 1", "line 6: T: '2' is no state");
  expectRefused("discount: fast\n", "line 1: discount: 'fast' is not a number");
}

TEST(PomdpFile, RefusesTheWrongCountOfNumbers) {
  expectRefused(PREAMBLE + "T: stay\n1 0 0\nO: * uniform",
                "line 8: T[stay] row wet: 3 numbers, expected 4");
  expectRefused(PREAMBLE + "T: stay : dry\n1 0 0\nO: * uniform",
                "line 7: T[stay] row dry: '0' after the 2 numbers begun in line 6");
  expectRefused(PREAMBLE + "T: stay : dry : wet", "line 6: T[stay] row dry: 0 numbers, expected 1");
  expectRefused(PREAMBLE + "T: go : dry : wet : dry 1", "line 6: T: 'dry' is one ':' too many");
  expectRefused(PREAMBLE + "R: go 1",
                "line 6: R: needs at least 2 names with ':' before its numbers");
}

TEST(PomdpFile, RefusesARowThatDoesNotSumToOneNamingTheLineThatSpokeOfItLast) {
  const auto text = PREAMBLE + TABLES + "T: go : wet\n0.5 0.53\n";
  expectRefused(text, "line 8: T[go] row wet sums to 1.03, not 1");
  EXPECT_NEAR(parse(text, true).T(1).coeff(1, 0), 0.5 / 1.03, 1e-15);
  expectRefused(PREAMBLE + "T: stay identity\nO: * uniform\n", "T[go] row dry has no entry");
  expectRefused(PREAMBLE + "start: 0.5 0.6\n" + TABLES, "line 6: start sums to 1.1, not 1");
  expectRefused(PREAMBLE + "T: * : * : dry -1\n",
                "line 6: T[stay] row dry column dry is -1, not a probability");
}

TEST(PomdpFile, RefusesAPreambleThatIsNotWhole) {
  expectRefused(without(PREAMBLE, "discount: 0.95\n") + TABLES,
                "line 5: discount: missing before this line");
  expectRefused(without(PREAMBLE, "values: reward\n") + TABLES,
                "line 5: values: missing before this line");
  expectRefused(without(PREAMBLE, "observations: sun rain\n") + TABLES,
                "line 6: O, but no observations");
  expectRefused("", "line 1: discount: missing before this line");
  expectRefused(PREAMBLE + "states: a b", "line 6: states: given twice, first in line 3");
  expectRefused(PREAMBLE + TABLES + "start: dry\n",
                "line 8: start: must come before the first T, O or R");
  expectRefused("states: a a\n", "line 1: states: 'a' is named twice");
  expectRefused("states: 0\n", "line 1: states: 0 is not a count in 1..1048576");
  expectRefused("states: actions: 2", "line 1: states: neither a count nor a name");
  expectRefused("values: gold", "line 1: values: 'gold' is neither reward nor cost");
  expectRefused("start: uniform", "line 1: states: missing before this line");
  expectRefused(PREAMBLE + "weather: fine", "line 6: observations: ':' is not a name");
  expectRefused("weather: fine", "line 1: expected a keyword and ':', not 'weather'");
}

TEST(PomdpFile, RefusesTablesBeyondTheLimits) {
  FileLimits limits;
  limits.values = 100;
  limits.entries = 1000;
  const auto parsed = [&](const std::string& text) {
    return refusal([&] { parsePomdpFile(text, "big", false, limits); });
  };
  EXPECT_EQ(parsed("discount: 1 values: reward states: 101"),
            "line 1: states: 101 is not a count in 1..100");
  EXPECT_EQ(parsed("discount: 1 values: reward states: 100 actions: 5 observations: 100\n"
                   "T: * uniform O: * uniform"),
            "tables of 100 states, 5 actions and 100 observations are too large");
}

class ModelFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::filesystem::path folder_;
};

TEST_F(ModelFile, IsReadByWhatItHoldsWhateverItsEnding) {
  const auto path = write("rain.POMDP", PREAMBLE + TABLES);
  EXPECT_EQ(loadModel(path).name(), "rain");
  const auto other = (folder_ / "rain.PomdpX").string();
  savePomdpx(loadPomdpFile(path), other);
  EXPECT_EQ(loadModel(other).states(), (Names{"dry", "wet"}));
  std::filesystem::rename(other, folder_ / "rain.txt");
  EXPECT_EQ(loadModel((folder_ / "rain.txt").string()).numStates(), 2);
}

TEST_F(ModelFile, IsNamedFirstWhenItIsRefused) {
  const auto path = write("bad.pomdp", "discount: x");
  EXPECT_EQ(refusal([&] { loadModel(path); }), path + ": line 1: discount: 'x' is not a number");
  EXPECT_EQ(refusal([&] { loadModel(path + "x"); }), path + "x: no such file");
}

TEST_F(ModelFile, TellsTheSameModelInBothFormats) {
  const auto from_x = loadModel(std::string(PACKAGE_DIR) + "/test/models/tiger.pomdpx");
  const auto m = loadModel(std::string(PACKAGE_DIR) + "/test/models/tiger.pomdp");
  EXPECT_EQ(m.states(), from_x.states());
  EXPECT_EQ(m.actions(), from_x.actions());
  EXPECT_EQ(m.R(), from_x.R());
  EXPECT_EQ(m.initialBelief(), from_x.initialBelief());
  for (int a = 0; a < m.numActions(); ++a) {
    EXPECT_EQ(m.T(a).toDense(), from_x.T(a).toDense());
    EXPECT_EQ(m.O(a).toDense(), from_x.O(a).toDense());
  }
}

}  // namespace
}  // namespace fabric::planner
