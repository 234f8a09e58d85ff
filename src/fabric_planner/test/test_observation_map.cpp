// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <set>

#include "fabric_planner/observation_map.hpp"
#include "fabric_planner/pomdpx.hpp"

namespace fabric::planner {
namespace {

const std::vector<std::string> SYMBOLS = {"calm", "late", "stop"};
const std::string FOLDER = PACKAGE_DIR;

std::string refusal(const std::string& text) {
  try {
    ObservationMap::parse(text, "tiny.obs.yaml", SYMBOLS);
  } catch (const ModelError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ObservationMap, LetsTheFirstRuleThatHoldsDecide) {
  const auto map = ObservationMap::parse(
      "rules: [{when: {warning: true}, symbol: stop},"
      "        {when: {warning: true, idle: true}, symbol: late}, {symbol: calm}]",
      "tiny", SYMBOLS);
  Features features;
  EXPECT_EQ(map.symbol(features), 0);
  features.warning = features.idle = true;
  EXPECT_EQ(map.symbol(features), 2);
}

TEST(ObservationMap, ComparesNumbersWithThresholds) {
  const auto map = ObservationMap::parse(
      "rules: [{when: {subtask_elapsed: {at_least: 15.0, below: 20}}, symbol: late},"
      "        {when: {failed_attempts: {at_least: 1}}, symbol: stop}, {symbol: calm}]",
      "tiny", SYMBOLS);
  Features features;
  features.subtask_elapsed = 14.9;
  EXPECT_EQ(map.symbol(features), 0);
  features.subtask_elapsed = 15.0;
  EXPECT_EQ(map.symbol(features), 1);
  features.subtask_elapsed = 20.0;
  EXPECT_EQ(map.symbol(features), 0);
  features.failed_attempts = 1;
  EXPECT_EQ(map.symbol(features), 2);
}

TEST(ObservationMap, RemembersTheSymbolBefore) {
  const auto map = ObservationMap::parse(
      "{initial: late, rules: [{when: {idle: true, previous: [late, stop]}, symbol: late},"
      "                        {symbol: calm}]}",
      "tiny", SYMBOLS);
  Features features;
  features.idle = true;
  EXPECT_EQ(map.symbol(features), 1) << "initial counts as the one before the first";
  EXPECT_EQ(map.symbol(features, 2), 1);
  EXPECT_EQ(map.symbol(features, 0), 0);
  EXPECT_THROW((void)map.symbol(features, 3), std::out_of_range);
}

TEST(ObservationMap, NamesFileAndRuleOfWhatItRefuses) {
  const auto expect = [](const std::string& text, const std::string& says) {
    EXPECT_NE(refusal(text).find(says), std::string::npos) << refusal(text);
  };
  expect("rules: [{when: {idle: true}, symbol: calm}]", "rule 1: the last rule has conditions");
  expect("rules: [{symbol: calm}, {symbol: late}]", "rule 2: is never reached");
  expect("rules: [{symbol: panic}]", "rule 1: the model has no observation 'panic'");
  expect("rules: [{when: {sleepy: true}, symbol: calm}, {symbol: calm}]",
         "rule 1: when: unknown name 'sleepy'");
  expect("rules: [{when: {idle: 3}, symbol: calm}, {symbol: calm}]",
         "rule 1: idle: expected true or false, got '3'");
  expect("rules: [{when: {waiting_time: 3}, symbol: calm}, {symbol: calm}]",
         "rule 1: waiting_time: expected a map, got '3'");
  expect("rules: [{when: {waiting_time: {at_least: .nan}}, symbol: calm}, {symbol: calm}]",
         "at_least: is NaN");
  expect("rules: [{when: {waiting_time: {}}, symbol: calm}, {symbol: calm}]",
         "expected at_least or below");
  expect("rules: [{when: {previous: calm}, symbol: late}, {symbol: calm}]", "initial is not given");
  expect("{initial: none, rules: [{symbol: calm}]}", "initial: the model has no observation");
  expect("rules: [{when: {}, symbol: calm}, {symbol: calm}]", "rule 1: when: has no condition");
  expect("rules: [{when: {idle: true, idle: false}, symbol: calm}, {symbol: calm}]",
         "'idle' given twice");
  expect("rules: []", "expected a list with at least one rule");
  expect("rules: [{symbol", "tiny.obs.yaml: yaml-cpp: error");
  EXPECT_THROW(ObservationMap::load("/nowhere/a.obs.yaml", SYMBOLS), ModelError);
}

/// Features out of the bits of a number: O1..O7, O8, O9, then the robot's own.
Features fromBits(unsigned bits) {
  bool Features::*const fields[] = {
      &Features::task_success,   &Features::task_failure,    &Features::detected,
      &Features::looking_around, &Features::grasp_attempt,   &Features::warning,
      &Features::idle,           &Features::subtask_success, &Features::subtask_failure,
      &Features::robot_success,  &Features::robot_failure};
  Features features;
  unsigned bit = 0;
  for (const auto field : fields) features.*field = (bits >> bit++ & 1U) != 0;
  return features;
}

class ShippedMap : public testing::TestWithParam<std::string> {};

TEST_P(ShippedMap, IsTotalAndUsesOnlySymbolsOfItsModel) {
  const std::string stem = FOLDER + "/models/" + GetParam();
  const Pomdp model = loadPomdpx(stem + ".pomdpx");
  const auto map = ObservationMap::load(stem + ".obs.yaml", model.observations());
  for (unsigned bits = 0; bits < 1U << 11; ++bits) {
    Features features = fromBits(bits);
    features.failed_attempts = bits % 3;
    features.waiting_time = bits % 31;
    const int symbol = map.symbol(features);
    ASSERT_GE(symbol, 0);
    ASSERT_LT(symbol, model.numObservations());
    ASSERT_LT(map.symbol(features, symbol), model.numObservations());
  }
}

INSTANTIATE_TEST_SUITE_P(Models, ShippedMap,
                         testing::Values("inspection_proactive", "inspection_reactive",
                                         "inspection_on_call", "sorting_proactive",
                                         "sorting_reactive", "sorting_on_call", "none"));

std::vector<std::string> numbered(int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back("o" + std::to_string(i));
  return names;
}

/// The original code of an observation: attentive 1, detected 2, grasp 4, success 8, warning 16,
/// idle 32, failure 64 (ORIGINAL layout), as our features.
Features fromCode(unsigned code) {
  Features features;
  features.looking_around = (code & 1U) == 0;
  features.detected = (code & 2U) != 0;
  features.grasp_attempt = (code & 4U) != 0;
  features.task_success = (code & 8U) != 0;
  features.warning = (code & 16U) != 0;
  features.idle = (code & 32U) != 0;
  features.task_failure = (code & 64U) != 0;
  return features;
}

TEST(OriginalMaps, GiveTheCodesThatAreListedTheirSymbols) {
  const std::vector<std::pair<unsigned, int>> codes = {
      {0, 0},   {1, 0},   {2, 1},   {3, 2},   {6, 3},   {7, 4},   {8, 5},   {9, 5},   {10, 5},
      {11, 5},  {14, 5},  {15, 5},  {16, 6},  {17, 6},  {18, 6},  {19, 6},  {27, 6},  {32, 7},
      {33, 7},  {34, 8},  {35, 9},  {40, 10}, {42, 10}, {43, 10}, {64, 11}, {65, 11}, {66, 11},
      {67, 11}, {70, 11}, {71, 11}, {80, 11}, {87, 11}, {96, 11}, {98, 11}, {99, 11}, {103, 11}};
  for (const int count : {12, 14}) {
    const auto map = ObservationMap::load(
        FOLDER + "/config/original_" + std::to_string(count) + ".obs.yaml", numbered(count));
    for (const auto& [code, symbol] : codes) {
      EXPECT_EQ(map.symbol(fromCode(code)), symbol) << "code " << code << ", " << count;
    }
  }
}

TEST(OriginalMaps, ReachEverySymbolOfTheirLayout) {
  for (const int count : {12, 14}) {
    const auto map = ObservationMap::load(
        FOLDER + "/config/original_" + std::to_string(count) + ".obs.yaml", numbered(count));
    std::set<int> seen;
    for (unsigned bits = 0; bits < 1U << 9; ++bits) seen.insert(map.symbol(fromBits(bits)));
    EXPECT_EQ(static_cast<int>(seen.size()), count);
  }
}

TEST(OriginalMaps, ShowPlacementsAsSymbolsOfTheirOwn) {
  const auto map = ObservationMap::load(FOLDER + "/config/original_14.obs.yaml", numbered(14));
  Features features;
  features.detected = features.idle = true;
  features.subtask_success = true;
  EXPECT_EQ(map.symbol(features), 12);
  features.subtask_success = false;
  features.subtask_failure = true;
  EXPECT_EQ(map.symbol(features), 13);
}

}  // namespace
}  // namespace fabric::planner
