// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fabric_planner/actions.hpp"

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
  friend ToolPose operator+(const ToolPose& a, const ToolPose& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z, a.yaw + b.yaw};
  }
};

/// A place that is known only when the gesture is played, used in way-points like a named pose.
inline const std::string TRAY = "tray";  ///< the next slot of the tray that the rules name
inline const std::string BACK = "back";  ///< where a cube at the cup goes back to

/// Whether things stand around a place, so that the tool comes and leaves from above it.
inline bool hasHeight(const std::string& place) {
  return place == "pick" || place == "drop_back" || place == TRAY || place == BACK;
}

/// A place of the cell for the tool to be at.
struct WayPoint {
  std::string place;   ///< a named pose, TRAY or BACK
  bool above = false;  ///< at the height over the place that `heights` gives
  ToolPose offset;     ///< added to the place
  double speed = 0.0;  ///< m/s
  double hold = 0.0;   ///< s to stand there

  /// Among the things that stand around the place.
  [[nodiscard]] bool isDown() const { return hasHeight(place) && !above; }
  [[nodiscard]] bool isAt(const std::string& name) const { return place == name && !above; }
  [[nodiscard]] bool isAbove(const std::string& name) const { return place == name && above; }
};

/// A way-point, or the suction switched between two of them.
struct GestureStep {
  std::optional<bool> suction;
  WayPoint way_point;
};

/// What the robot shows (thesis 6.2.5): way-points with speed and timing.
struct Gesture {
  Action action = Action::IDLE;  ///< what it stands for: arbitrated as that, Table 6.5
  std::vector<GestureStep> steps;
};

}  // namespace fabric::planner
