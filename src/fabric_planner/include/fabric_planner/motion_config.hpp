// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace fabric::planner {

/// Of the tool centre point in arm_base_link: m, rad.
struct ToolPose {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double yaw = 0.0;

  /// The pose at another height.
  [[nodiscard]] ToolPose at(double height) const { return {x, y, height, yaw}; }
  friend bool operator==(const ToolPose& a, const ToolPose& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.yaw == b.yaw;
  }
  friend bool operator!=(const ToolPose& a, const ToolPose& b) { return !(a == b); }
};

/// Places, speeds and times of the robot's actions: m, rad, m/s, s (config/motion.yaml).
struct MotionConfig {
  ToolPose home;
  ToolPose planning;
  ToolPose pick;
  ToolPose drop_back;
  ToolPose side;
  ToolPose attention;
  ToolPose point;
  std::map<std::string, ToolPose> trays;         ///< by label
  std::vector<std::pair<double, double>> slots;  ///< (x, y) beside the tray's pose
  std::string inspection_tray;                   ///< a label of trays
  double above_pick = 0.0;
  double above_tray = 0.0;
  double travel_speed = 0.0;
  double vertical_speed = 0.0;
  double gesture_speed = 0.0;
  double withdraw_speed = 0.0;
  double plan_time = 0.0;
  double grip_time = 0.0;
  double release_time = 0.0;
  int nods = 0;
  double nod_depth = 0.0;

  /// @throw ModelError naming file, entry and value: missing or unknown entries, numbers that are
  ///        not finite, speeds and times that are not positive, heights below their places.
  static MotionConfig load(const std::string& path);
  static MotionConfig parse(const std::string& text, const std::string& name);

  /// Where the cube number `count` (from 0) goes in a tray. @throw std::out_of_range for a label.
  [[nodiscard]] ToolPose slot(const std::string& label, unsigned count) const;
};

}  // namespace fabric::planner
