// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "fabric_planner/pomdp.hpp"
#include "motion_bench.hpp"

namespace fabric::planner {
namespace {

std::string shipped() {
  std::ifstream file(test::MOTION_YAML);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The shipped file with one piece of it replaced.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = shipped();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
  try {
    MotionConfig::parse(text, "motion.yaml");
  } catch (const ModelError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(MotionConfig, ReadsTheShippedFile) {
  const MotionConfig config = MotionConfig::load(test::MOTION_YAML);
  EXPECT_EQ(config.pick, (ToolPose{0.281, 0.035, 0.012, 0.0}));
  EXPECT_EQ(config.trays.size(), 4U);
  EXPECT_EQ(config.inspection_tray, "inspected");
  EXPECT_EQ(config.nods, 2);
}

TEST(MotionConfig, GivesTheSlotsOfATrayInTurn) {
  const MotionConfig config = MotionConfig::load(test::MOTION_YAML);
  const auto n = static_cast<unsigned>(config.slots.size());
  EXPECT_NE(config.slot("red", 0), config.slot("red", 1));
  EXPECT_EQ(config.slot("red", 0), config.slot("red", n));
  EXPECT_EQ(config.slot("red", 0), config.trays.at("red"));
  EXPECT_THROW((void)config.slot("violet", 0), std::out_of_range);
}

TEST(MotionConfig, NamesFileEntryAndValueOfWhatItRefuses) {
  const auto expect = [](const std::string& from, const std::string& to, const std::string& says) {
    EXPECT_NE(refusal(changed(from, to)).find(says), std::string::npos)
        << refusal(changed(from, to));
  };
  expect("x: 0.197", "x: .nan", "motion.yaml: poses: home: x: is NaN");
  expect("x: 0.197", "x: .inf", "motion.yaml: poses: home: x: is infinite");
  expect("x: 0.197, ", "", "motion.yaml: poses: home: x: expected a number, got nothing");
  expect("x: 0.197", "x: left", "expected a number, got 'left'");
  expect("travel: 0.12", "travel: 0", "speeds: travel: 0.000000 is not positive");
  expect("travel: 0.12", "travel: 0.1\n  fast: 1", "speeds: unknown name 'fast'");
  expect("plan: 3.4", "plan: -1", "times: plan: -1.000000 is not positive");
  expect("nods: 2", "nods: 1.5", "nods: 1.500000 is not a whole number");
  expect("inspection_tray: inspected", "inspection_tray: blau", "there is no tray 'blau'");
  expect("above_pick: 0.072", "above_pick: 0.01", "heights: above_pick: 0.010000 is not above");
  expect("above_tray: 0.050", "above_tray: -0.1", "heights: above_tray: -0.100000 is not above");
  expect("home: {x", "home: {x: 0, x", "poses: home: 'x' given twice");
}

TEST(MotionConfig, RefusesFilesThatCannotBeRead) {
  EXPECT_THROW(MotionConfig::load("/nowhere/motion.yaml"), ModelError);
  EXPECT_NE(refusal("poses: [1, 2"), "accepted");
  EXPECT_NE(refusal("just text"), "accepted");
}

}  // namespace
}  // namespace fabric::planner
