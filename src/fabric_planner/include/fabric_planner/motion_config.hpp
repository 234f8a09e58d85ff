// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fabric_planner/gesture.hpp"

namespace fabric::planner {

/// Places, speeds and gestures of the robot: m, rad, m/s, s (config/motion.yaml, docs/motion.md).
struct MotionConfig {
  std::map<std::string, ToolPose> poses;         ///< home, pick, drop_back, side and more, by name
  std::map<std::string, ToolPose> trays;         ///< by label
  std::vector<std::pair<double, double>> slots;  ///< (x, y) beside the tray's pose
  std::string inspection_tray;                   ///< a label of trays
  double above_pick = 0.0;                       ///< height over pick and drop_back
  double above_tray = 0.0;                       ///< height over trays
  std::map<std::string, double> speeds;          ///< by name; travel, vertical and more
  std::map<std::string, Gesture> gestures;       ///< by name
  std::map<Action, std::string> chosen;          ///< the gesture of each action
  int lost_after = 1;  ///< views of the cell in a row without the cube until it is lost

  /// @throw ModelError naming file, entry and value: missing or unknown entries, numbers that are
  ///        not finite, speeds that are not positive, heights below their places, gestures that
  ///        would hit something or do not do what their action is for.
  static MotionConfig load(const std::string& path);
  static MotionConfig parse(const std::string& text, const std::string& name);

  [[nodiscard]] const ToolPose& home() const { return poses.at("home"); }
  [[nodiscard]] const ToolPose& pick() const { return poses.at("pick"); }
  [[nodiscard]] const ToolPose& dropBack() const { return poses.at("drop_back"); }
  [[nodiscard]] const ToolPose& side() const { return poses.at("side"); }
  [[nodiscard]] double travelSpeed() const { return speeds.at("travel"); }
  [[nodiscard]] double verticalSpeed() const { return speeds.at("vertical"); }

  /// The gesture of that name; of the empty name, the chosen one of the action.
  /// @throw ModelError naming a gesture that there is not
  [[nodiscard]] const Gesture& gesture(Action action, const std::string& name = "") const;

  /// Where the cube number `count` (from 0) goes in a tray. @throw std::out_of_range for a label.
  [[nodiscard]] ToolPose slot(const std::string& label, unsigned count) const;
};

}  // namespace fabric::planner
