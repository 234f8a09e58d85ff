// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "fabric_planner/motion_agent.hpp"

namespace fabric::planner::test {

inline const std::string MOTION_YAML = std::string(PACKAGE_DIR) + "/config/motion.yaml";

inline TaskView sortingTask(std::uint32_t id, int status) {
  return {id, status, "sorting", {{1, "red"}, {2, "green"}, {3, "blue"}}};
}

inline constexpr int SHOWING_RULES = 1;
inline constexpr int RUNNING = 2;
inline constexpr int RED = 1;
inline constexpr double SLOW_FACTOR = 0.4;

/// A motion agent with a pretend arm that keeps the books: what is outstanding, what was sent.
class MotionBench {
 public:
  MotionBench() : agent(MotionConfig::load(MOTION_YAML)) {}

  /// A task is running, a red cube stands at the pick point and the arm at home.
  static MotionBench ready() {
    MotionBench bench;
    bench.apply(bench.agent.onTask(sortingTask(1, RUNNING)));
    bench.finish();
    bench.cube(true);
    bench.log.clear();
    bench.agent.takeEnds();
    return bench;
  }

  /// Takes in the commands and checks what must always hold.
  void apply(const MotionCommands& commands) {
    for (const MotionCommand& command : commands) {
      if (command.kind == MotionCommand::Kind::MOVE) {
        EXPECT_FALSE(outstanding) << "two outstanding moves";
        EXPECT_FALSE(agent.stopped()) << "a move while stopped";
        EXPECT_FALSE(agent.heldByWarning()) << "a move while held by a warning";
        EXPECT_NE(agent.separation(), Separation::STOP) << "a move while a hand is too close";
        EXPECT_EQ(command.number, moves + 1);
        EXPECT_GT(command.speed, 0.0);
        ++moves;
        outstanding = command;
        cancelled = false;
      } else if (command.kind == MotionCommand::Kind::CANCEL) {
        ASSERT_TRUE(outstanding) << "nothing to cancel";
        EXPECT_EQ(command.number, outstanding->number);
        EXPECT_FALSE(cancelled) << "cancelled twice";
        cancelled = true;
      } else {
        suction = command.kind == MotionCommand::Kind::SUCTION_ON;
      }
      log.push_back(command);
    }
  }

  /// The outstanding move ends.
  void arm(ArmOutcome outcome) {
    ASSERT_TRUE(outstanding);
    const std::uint32_t number = outstanding->number;
    if (outcome == ArmOutcome::REACHED) tool = outstanding->pose;
    outstanding.reset();
    apply(agent.onArmResult(number, outcome, "as the test wants"));
  }

  /// The outstanding move ends as it should; a cube that is lifted leaves the pick point.
  void step() {
    ASSERT_TRUE(outstanding);
    const bool lifts = suction && tool == places.pick() && outstanding->pose.z > tool.z;
    if (lifts && sticks && !cancelled) cube(false);
    arm(cancelled ? ArmOutcome::PRE_EMPTED : ArmOutcome::REACHED);
  }

  /// Every move is carried out.
  void finish() {
    for (int i = 0; outstanding && i < 100; ++i) step();
    EXPECT_FALSE(outstanding);
  }

  /// Goes on until the next move to come is to this pose.
  void until(const ToolPose& pose) {
    for (int i = 0; outstanding && !(outstanding->pose == pose) && i < 100; ++i) step();
    ASSERT_TRUE(outstanding) << "the pose never came";
  }

  void play(const std::string& gesture) { apply(agent.onGesture(gesture)); }
  void separate(Separation level) { apply(agent.onSeparation(level, SLOW_FACTOR)); }

  void decide(Action action) { apply(agent.onDecision(action, ++decisions)); }

  /// The camera sees a red cube at the cup, or none.
  void seeAtCup(bool present) {
    std::vector<SeenCube> cubes;
    if (present) cubes.push_back({RED, SeenCube::WHERE_ROBOT, 0.9});
    apply(agent.onCubes(cubes));
  }

  /// The sensor and the camera see a red cube at the pick point, or none.
  void cube(bool present) {
    apply(agent.onConveyor(present));
    std::vector<SeenCube> cubes;
    if (present) cubes.push_back({RED, SeenCube::WHERE_PICK_POINT, 0.9});
    apply(agent.onCubes(cubes));
  }

  [[nodiscard]] std::vector<ToolPose> path() const {
    std::vector<ToolPose> poses;
    for (const MotionCommand& command : log) {
      if (command.kind == MotionCommand::Kind::MOVE) poses.push_back(command.pose);
    }
    return poses;
  }

  /// How the newest ended request ended.
  [[nodiscard]] ActionOutcome lastEnd() {
    const std::vector<ActionEnd> ends = agent.takeEnds();
    EXPECT_FALSE(ends.empty());
    return ends.empty() ? ActionOutcome::DONE : ends.back().outcome;
  }

  MotionConfig places = MotionConfig::load(MOTION_YAML);
  MotionAgent agent;
  bool sticks = true;  ///< cubes come along when they are lifted
  std::vector<MotionCommand> log;
  std::optional<MotionCommand> outstanding;
  ToolPose tool;
  bool cancelled = false;
  bool suction = false;
  std::uint32_t moves = 0;
  std::uint32_t decisions = 0;
};

}  // namespace fabric::planner::test
