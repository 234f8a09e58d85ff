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
  EXPECT_EQ(config.pick(), (ToolPose{0.281, 0.035, 0.012, 0.0}));
  EXPECT_EQ(config.trays.size(), 4U);
  EXPECT_EQ(config.inspection_tray, "inspected");
  EXPECT_EQ(config.gestures.size(), 7U);
  EXPECT_EQ(config.chosen.at(Action::PLANNING), "planning_2");
  EXPECT_EQ(config.chosen.at(Action::POINT), "pointing_1");
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
  expect("travel: 0.12", "walk: 0.12", "motion.yaml: speeds: 'travel' is missing");
  expect("  side: {", "  aside: {", "motion.yaml: poses: 'side' is missing");
  expect("  side: {", "  tray: {x: 0, y: 0, z: 0, yaw: 0}\n  side: {", "poses: tray: the name");
  expect("lost_after: 3", "lost_after: 1.5", "lost_after: 1.500000 is not a whole number");
  expect("inspection_tray: inspected", "inspection_tray: blau", "there is no tray 'blau'");
  expect("above_pick: 0.072", "above_pick: 0.01", "heights: above_pick: 0.010000 is not above");
  expect("above_tray: 0.050", "above_tray: -0.1", "heights: above_tray: -0.100000 is not above");
  expect("home: {x", "home: {x: 0, x", "poses: home: 'x' given twice");
}

TEST(MotionConfig, NamesTheStepOfAGestureThatItRefuses) {
  const auto expect = [](const std::string& from, const std::string& to, const std::string& says) {
    EXPECT_NE(refusal(changed(from, to)).find(says), std::string::npos)
        << refusal(changed(from, to));
  };
  const std::string over = "{pose: over_cube, speed: travel, hold: 3.4}";
  const auto planning = [&](const std::string& step, const std::string& says) {
    expect(over, step, "motion.yaml: gestures: planning_1: step 1: " + says);
  };
  planning("{pose: moon, speed: travel}", "pose: there is no pose 'moon'; known: back, tray");
  planning("{pose: home, speed: quick}", "speed: expected a number, got 'quick'");
  planning("{pose: home, speed: 0}", "speed: 0.000000 is not positive");
  planning("{pose: home}", "speed: expected a number, got nothing");
  planning("{pose: home, speed: 0.1, hold: -1}", "hold: -1.000000 is negative");
  planning("{pose: home, speed: 0.1, hold: .nan}", "hold: is NaN");
  planning("{pose: home, speed: 0.1, wait: 1}", "unknown name 'wait'");
  planning("{pose: home, speed: 0.1, offset: {up: 1}}", "offset: unknown name 'up'");
  planning("{pose: home, speed: 0.1, above: true}", "above: `heights` gives none over 'home'");
  planning("{pose: pick, speed: 0.1, above: true, offset: {z: 1}}", "above: not together with");
  planning("{pose: pick, speed: 0.1, above: 7}", "above: expected true or false, got '7'");
  planning("{pose: pick, speed: 0.1}", "'pick': begins down there");
  planning("{pose: tray, above: true, speed: 0.1}", "'tray': only in a grasp");
  planning("{pose: back, above: true, speed: 0.1}", "'back': only in a cancel");
  expect(over, "{suction: on}", "motion.yaml: gestures: planning_1: no way-point");
  expect(over, over + "\n      - {suction: on}", "planning_1: step 2: suction: only in a grasp or");
  expect("steps:\n      - " + over, "steps: []", "planning_1: steps: expected a list with");
  expect("planning_1:          # right above the cube, just before grasping\n    action: planning",
         "planning_1:\n    action: dance", "unknown action 'dance'");
}

TEST(MotionConfig, RefusesGesturesThatWouldHitSomethingOrMissTheirPoint) {
  const auto expect = [](const std::string& from, const std::string& to, const std::string& says) {
    EXPECT_NE(refusal(changed(from, to)).find(says), std::string::npos)
        << refusal(changed(from, to));
  };
  expect("- {pose: pick, above: true, speed: travel}", "- {pose: side, speed: travel}",
         "gestures: grasp: step 2: 'pick': straight down from 'side'");
  expect("- {pose: pick, above: true, speed: vertical}", "- {pose: side, speed: vertical}",
         "gestures: grasp: step 5: 'side': straight from down at 'pick'");
  expect("      - {pose: side, speed: travel}\n      - {pose: tray", "      - {pose: tray",
         "gestures: grasp: step 6: 'tray': not by way of side");
  expect("      - {pose: side, speed: travel}\n      - {pose: home, speed: withdraw}\n  cancel:",
         "      - {pose: home, speed: withdraw}\n  cancel:",
         "gestures: grasp: step 12: 'home': not back by way of side");
  expect("      - {suction: on}\n", "", "grasp: switches the suction 1 times; 'grasp' does it 2");
  expect("- {suction: on}", "- {suction: off}", "grasp: step 3: suction: expected on");
  expect("      - {pose: pick, speed: vertical, hold: 0.4}\n", "",
         "grasp: step 3: suction: expected 'pick' right before it and after it, then above it");
  expect("      - {pose: home, speed: gesture}\n  pointing_2:", "  pointing_2:",
         "pointing_1: step 5: 'point': ends there; 'point' has to end at home");
  expect("{pose: beside_belt, speed: travel, hold: 3.4}",
         "{pose: pick, above: true, speed: travel}\n      - {pose: pick, speed: travel}",
         "planning_2: step 2: 'pick': ends down there");
}

TEST(MotionConfig, RefusesChoicesThatDoNotFit) {
  EXPECT_NE(refusal(changed("planning: planning_2", "planning: planning_3"))
                .find("chosen: planning: there is no gesture 'planning_3'"),
            std::string::npos);
  EXPECT_NE(refusal(changed("planning: planning_2", "planning: pointing_1"))
                .find("chosen: planning: the gesture 'pointing_1' stands for 'point'"),
            std::string::npos);
  EXPECT_NE(refusal(changed("  point: pointing_1\n", "")).find("chosen: point: expected a name"),
            std::string::npos);
}

TEST(MotionConfig, RefusesFilesThatCannotBeRead) {
  EXPECT_THROW(MotionConfig::load("/nowhere/motion.yaml"), ModelError);
  EXPECT_NE(refusal("poses: [1, 2"), "accepted");
  EXPECT_NE(refusal("just text"), "accepted");
}

}  // namespace
}  // namespace fabric::planner
