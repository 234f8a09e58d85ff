// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "fabric_planner/pomdp.hpp"
#include "fabric_planner/safety_monitor.hpp"

namespace fabric::planner {
namespace {

const std::string SAFETY_YAML = std::string(PACKAGE_DIR) + "/config/safety.yaml";
const ArmLinks LINKS{0.135, 0.147, 0.0597};
constexpr Point3 TOOL{0.20, 0.0, 0.05};
constexpr double NEVER = std::numeric_limits<double>::infinity();

SafetyParameters parameters() {
  SafetyParameters p = SafetyParameters::load(SAFETY_YAML);
  p.slow_distance = 0.30;
  p.stop_distance = 0.10;
  p.hysteresis = 0.02;
  p.stale_after = 0.5;
  p.gone_after = 1.0;
  return p;
}

/// A monitor whose arm stands still and whose hand comes along its x axis.
class Bench {
 public:
  /// The hand is so far ahead of the tool, m.
  const SeparationState& at(double ahead, bool visible = true, double age = 0.0) {
    now += 0.1;
    monitor.onTool(now, TOOL);
    monitor.onHand({now, visible, {TOOL.x + ahead, TOOL.y, TOOL.z}, age});
    return monitor.assess(now);
  }

  SafetyMonitor monitor{parameters(), LINKS};
  double now = 10.0;
};

TEST(SafetyMonitor, RunsSlowsAndStopsByTheDistance) {
  Bench bench;
  EXPECT_EQ(bench.at(0.5).level, Separation::RUN);
  EXPECT_EQ(bench.monitor.state().cause, "");
  EXPECT_NEAR(bench.monitor.state().distance, 0.5, 1e-12);
  EXPECT_EQ(bench.at(0.29).level, Separation::SLOW);
  EXPECT_EQ(bench.monitor.state().cause, "the hand is 0.29 m from the arm");
  EXPECT_EQ(bench.at(0.09).level, Separation::STOP);
  EXPECT_EQ(bench.monitor.state().cause, "the hand is 0.09 m from the arm; goes on beyond 0.12 m");
}

TEST(SafetyMonitor, GoesBackOnlyBeyondTheHysteresis) {
  Bench bench;
  bench.at(0.09);
  EXPECT_EQ(bench.at(0.11).level, Separation::STOP);
  EXPECT_EQ(bench.at(0.125).level, Separation::SLOW);
  EXPECT_EQ(bench.at(0.11).level, Separation::SLOW)
      << "coming in again, the distance itself counts";
  EXPECT_EQ(bench.at(0.31).level, Separation::SLOW);
  EXPECT_EQ(bench.at(0.33).level, Separation::RUN);
  EXPECT_EQ(bench.at(0.31).level, Separation::RUN);
}

TEST(SafetyMonitor, MeasuresToTheNearestLinkAndNotOnlyToTheTool) {
  const SafetyMonitor monitor(parameters(), LINKS);
  const auto joints = monitor.links(TOOL);
  const Point3& elbow = joints[1];
  const Point3& wrist = joints[2];
  EXPECT_NEAR(std::hypot(elbow.x, elbow.y, elbow.z), 0.135, 1e-12);
  EXPECT_NEAR(std::hypot(wrist.x - elbow.x, wrist.y - elbow.y, wrist.z - elbow.z), 0.147, 1e-12);
  EXPECT_NEAR(TOOL.x - wrist.x, 0.0597, 1e-12);
  EXPECT_GT(elbow.z, wrist.z) << "elbow up";
  const Point3 over{elbow.x, elbow.y, elbow.z + 0.04};
  EXPECT_NEAR(monitor.distance(over, TOOL), 0.04, 1e-12);
}

TEST(SafetyMonitor, TurnsTheLinksWithTheArm) {
  const SafetyMonitor monitor(parameters(), LINKS);
  const double turn = 0.7;
  const Point3 turned{TOOL.x * std::cos(turn), TOOL.x * std::sin(turn), TOOL.z};
  const Point3 hand{0.3, 0.1, 0.1};
  const Point3 with{hand.x * std::cos(turn) - hand.y * std::sin(turn),
                    hand.x * std::sin(turn) + hand.y * std::cos(turn), hand.z};
  EXPECT_NEAR(monitor.distance(with, turned), monitor.distance(hand, TOOL), 1e-12);
}

TEST(SafetyMonitor, IsSlowUntilItKnowsHandAndArm) {
  SafetyMonitor monitor(parameters(), LINKS);
  EXPECT_EQ(monitor.assess(1.0).level, Separation::SLOW);
  EXPECT_EQ(monitor.state().cause, "arm/tcp has not come yet");
  monitor.onTool(1.0, TOOL);
  EXPECT_EQ(monitor.assess(1.0).level, Separation::SLOW);
  EXPECT_EQ(monitor.state().cause, "human/hand has not come yet");
  EXPECT_TRUE(std::isnan(monitor.state().distance));
}

TEST(SafetyMonitor, NobodyThereIsNoReasonToBeSlow) {
  Bench bench;
  EXPECT_EQ(bench.at(0.0, false, NEVER).level, Separation::RUN);
  EXPECT_TRUE(std::isinf(bench.monitor.state().distance));
}

TEST(SafetyMonitor, OldWordIsSlowAndSaysSo) {
  Bench bench;
  bench.at(0.5);
  EXPECT_EQ(bench.monitor.assess(bench.now + 0.4).level, Separation::RUN);
  EXPECT_EQ(bench.monitor.assess(bench.now + 0.6).level, Separation::SLOW);
  EXPECT_EQ(bench.monitor.state().cause, "arm/tcp is 0.60 s old");
  bench.monitor.onTool(bench.now + 0.6, TOOL);
  EXPECT_EQ(bench.monitor.assess(bench.now + 0.6).level, Separation::SLOW);
  EXPECT_EQ(bench.monitor.state().cause, "human/hand is 0.60 s old");
  EXPECT_EQ(bench.at(0.5).level, Separation::RUN);
}

TEST(SafetyMonitor, WordFromTheFutureIsNotTrusted) {
  Bench bench;
  bench.at(0.5);
  EXPECT_EQ(bench.monitor.assess(bench.now - 1.0).level, Separation::SLOW);
  EXPECT_EQ(bench.monitor.state().cause, "arm/tcp is 1.00 s ahead of time");
}

TEST(SafetyMonitor, OldWordDoesNotEndAStop) {
  Bench bench;
  bench.at(0.05);
  EXPECT_EQ(bench.monitor.assess(bench.now + 60.0).level, Separation::STOP);
}

TEST(SafetyMonitor, AHandOutOfViewIsWhereItWasSeenLast) {
  Bench bench;
  bench.at(0.05);
  EXPECT_EQ(bench.at(0.05, false, 0.5).level, Separation::STOP);
  EXPECT_EQ(bench.at(0.05, false, 1.5).level, Separation::SLOW) << "it may be anywhere near there";
  EXPECT_EQ(bench.monitor.state().cause, "the hand was lost from view 0.05 m from the arm");
  EXPECT_EQ(bench.at(0.05, false, 600.0).level, Separation::SLOW);
  EXPECT_EQ(bench.at(0.5, false, 1.5).level, Separation::RUN);
}

TEST(SafetyMonitor, RefusesNumbersThatMakeNoSenseAndKeepsWhatItKnew) {
  Bench bench;
  bench.at(0.05);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(bench.monitor.onTool(bench.now, {nan, 0.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(bench.monitor.onHand({bench.now, true, {0.0, nan, 0.0}, 0.0}),
               std::invalid_argument);
  EXPECT_THROW(bench.monitor.onHand({bench.now, true, {}, nan}), std::invalid_argument);
  EXPECT_THROW(bench.monitor.onHand({bench.now, true, {}, -1.0}), std::invalid_argument);
  EXPECT_EQ(bench.monitor.assess(bench.now).level, Separation::STOP);
}

TEST(ArmPlace, TurnsAndShiftsFromTheCell) {
  const ArmPlace arm{{0.1, 0.2, 0.3}, M_PI / 2};
  const Point3 p = arm.fromCell({0.1, 0.7, 0.4});
  EXPECT_NEAR(p.x, 0.5, 1e-12);
  EXPECT_NEAR(p.y, 0.0, 1e-12);
  EXPECT_NEAR(p.z, 0.1, 1e-12);
}

std::string refusal(const std::string& from, const std::string& to) {
  std::ifstream file(SAFETY_YAML);
  std::ostringstream text;
  text << file.rdbuf();
  std::string all = text.str();
  all.replace(all.find(from), from.size(), to);
  try {
    SafetyParameters::parse(all, "safety.yaml");
  } catch (const ModelError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SafetyParameters, NamesFileEntryAndValueOfWhatItRefuses) {
  EXPECT_EQ(refusal("stop_distance: 0.12", "stop_distance: .nan"),
            "safety.yaml: stop_distance: is NaN");
  EXPECT_EQ(refusal("stop_distance: 0.12", "stop_distance: 0.5"),
            "safety.yaml: slow_distance: 0.250000 is not more than stop_distance, 0.500000");
  EXPECT_EQ(refusal("slow_factor: 0.4", "slow_factor: 1.4"),
            "safety.yaml: slow_factor: 1.400000 is more than 1");
  EXPECT_EQ(refusal("hysteresis: 0.02", "hysteresis: -1"),
            "safety.yaml: hysteresis: -1.000000 is negative");
  EXPECT_EQ(refusal("stale_after: 0.5", ""),
            "safety.yaml: stale_after: expected a number, got nothing");
}

TEST(ArmLinks, AreReadFromTheLimitsOfTheArm) {
  const std::string path = testing::TempDir() + "arm_links.yaml";
  std::ofstream(path) << "links: {rear_arm: 0.1, forearm: 0.2, tool_x: 0.0, tool_y: 0}\n";
  const ArmLinks links = ArmLinks::load(path);
  EXPECT_EQ(links.rear_arm, 0.1);
  EXPECT_EQ(links.forearm, 0.2);
  std::ofstream(path) << "links: {rear_arm: 0, forearm: 0.2, tool_x: 0.0}\n";
  try {
    ArmLinks::load(path);
    FAIL() << "a link without length was accepted";
  } catch (const ModelError& error) {
    EXPECT_EQ(error.what(), path + ": links: rear_arm: 0.000000 is not positive");
  }
}

}  // namespace
}  // namespace fabric::planner
