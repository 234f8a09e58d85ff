// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>

#include "fabric_planner/motion_agent.hpp"

namespace fabric::planner {

/// A point in arm_base_link, m.
struct Point3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

/// Where the arm stands in the frame cell: m, rad.
struct ArmPlace {
  Point3 origin;
  double yaw = 0.0;

  /// From `frames: arm_base_link` of cell.yaml. @throw ModelError naming file, entry and value
  static ArmPlace load(const std::string& path);
  [[nodiscard]] Point3 fromCell(const Point3& point) const;
};

/// Distances and times of speed-and-separation monitoring (config/safety.yaml, docs/motion.md).
struct SafetyParameters {
  double slow_distance = 0.0;  ///< m, from the hand's middle to the arm's axes: slow below
  double stop_distance = 0.0;  ///< m: stop below
  double hysteresis = 0.0;     ///< m, more than a distance until it is over
  double slow_factor = 1.0;    ///< of all speeds while slow
  double stale_after = 0.0;    ///< s: word of hand or arm that is older is not trusted
  double gone_after = 0.0;     ///< s out of view until a hand counts as gone

  /// @throw ModelError naming file, entry and value
  static SafetyParameters load(const std::string& path);
  static SafetyParameters parse(const std::string& text, const std::string& name);
};

/// Lengths of the arm, m.
struct ArmLinks {
  double rear_arm = 0.0;
  double forearm = 0.0;
  double tool_x = 0.0;  ///< from the wrist to the suction cup, along the arm

  /// Reads `links` of a magician.yaml. @throw ModelError naming file, entry and value
  static ArmLinks load(const std::string& path);
};

/// The tracked hand (fabric_msgs/HandState), in arm_base_link.
struct SeenHand {
  double stamp = 0.0;  ///< s, of the picture
  bool visible = false;
  Point3 position;   ///< where it is, or was seen last
  double age = 0.0;  ///< s since it was seen; infinite before the first time
};

/// What the distance between hand and arm allows.
struct SeparationState {
  Separation level = Separation::SLOW;
  double distance = std::numeric_limits<double>::quiet_NaN();  ///< m; infinite with nobody there
  std::string cause;                                           ///< empty when RUN
};

/// Speed-and-separation monitoring: how close the hand is to the arm's links, and what follows.
///
/// Without a clock: time is in the messages, and `assess` is told what time it is. Word that is
/// missing, old or from the future never means RUN, and it never ends a stop.
class SafetyMonitor {
 public:
  SafetyMonitor(SafetyParameters parameters, ArmLinks links)
      : parameters_(parameters), links_(links) {}

  /// The tool in arm_base_link, m, at a time, s. @throw std::invalid_argument for NaN and infinity
  void onTool(double stamp, const Point3& tool);
  /// @throw std::invalid_argument for numbers that make no sense
  void onHand(const SeenHand& hand);
  const SeparationState& assess(double now);
  /// Whether all that is known is there and new enough.
  [[nodiscard]] bool trusts(double now) const { return distrust(now).empty(); }
  /// Stamp of the newest message, s; 0 before the first.
  [[nodiscard]] double newest() const;

  [[nodiscard]] const SeparationState& state() const { return state_; }
  [[nodiscard]] const SafetyParameters& parameters() const { return parameters_; }
  /// The joints of the arm from its base to the tool, m, for a tool at this place.
  [[nodiscard]] std::array<Point3, 4> links(const Point3& tool) const;
  /// From a point to the nearest link, m.
  [[nodiscard]] double distance(const Point3& point, const Point3& tool) const;

 private:
  [[nodiscard]] std::string distrust(double now) const;
  SeparationState judge();

  SafetyParameters parameters_;
  ArmLinks links_;
  std::optional<SeenHand> hand_;
  Point3 tool_;
  std::optional<double> tool_stamp_;
  Separation zone_ = Separation::RUN;  ///< by distance alone, with hysteresis
  SeparationState state_;
};

}  // namespace fabric::planner
