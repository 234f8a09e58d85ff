// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "fabric_planner/motion_config.hpp"

namespace fabric::planner {

/// Where an action is on its way, numbered as in fabric_msgs/RobotActionState.
enum class Phase : std::uint8_t { REST = 0, APPROACH = 1, CONTACT = 2, CARRY = 3, RETREAT = 4 };

/// What a step does besides ending.
enum class StepKind {
  MOVE,         ///< one goal for the arm
  CHECK_CUBE,   ///< is there still a cube to take, and a tray for it?
  SUCTION_ON,   ///
  CHECK_GRIP,   ///< did the cube stay at the pick point's sensor, so that it hangs at the cup?
  CHECK_LIFT,   ///< did the cube come along?
  SUCTION_OFF,  ///
};

/// One step of a script. A step of kind MOVE says what remains to do if it is broken off half way.
struct Step {
  StepKind kind = StepKind::MOVE;
  Phase phase = Phase::REST;
  ToolPose target;              ///< MOVE
  double speed = 0.0;           ///< m/s, MOVE
  double settle = 0.0;          ///< s, MOVE
  std::optional<ToolPose> low;  ///< MOVE among obstacles: rise to this pose before going elsewhere
  bool far = false;             ///< MOVE beyond `side`: go back by way of it
  bool planned = false;         ///< MOVE that ends with the grasp planned
};

using Script = std::deque<Step>;

/// What the arm has to be freed from before it goes somewhere else.
struct Entanglement {
  std::optional<ToolPose> low;  ///< rise to this pose first
  bool far = false;             ///< then go by way of `side`
  bool at_pick = false;         ///< low, and at the pick point
};

/// Gestures as lists of moves and suction commands; nothing here knows of time.
class ScriptWriter {
 public:
  explicit ScriptWriter(const MotionConfig& config) : config_(config) {}

  /// Rise, and come back to the side of the belt.
  [[nodiscard]] Script free(const Entanglement& from) const;
  /// As free, and put down the cube at the cup: where it came from, or where the belt begins.
  [[nodiscard]] Script putBack(const Gesture& cancel, const Entanglement& from) const;
  /// What a cancel shows when no cube hangs at the cup, or not any more.
  [[nodiscard]] Script withdraw(const Gesture& cancel) const;
  /// A gesture without suction.
  [[nodiscard]] Script show(const Gesture& gesture) const;
  /// The same; at its end the grasp is planned.
  [[nodiscard]] Script plan(const Gesture& gesture) const;
  /// The part of a grasp that ends with the cube lifted.
  [[nodiscard]] Script pick(const Gesture& grasp) const;
  /// The rest of it; `slot` is where the cube goes.
  [[nodiscard]] Script place(const Gesture& grasp, const ToolPose& slot) const;
  /// Where a gesture without suction ends.
  [[nodiscard]] ToolPose endOf(const Gesture& gesture) const;

 private:
  [[nodiscard]] Step move(Phase phase, const ToolPose& target, double speed) const;

  MotionConfig config_;
};

/// `tail` after `head`.
Script operator+(Script head, const Script& tail);

}  // namespace fabric::planner
