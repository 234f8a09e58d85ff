// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fabric_msgs/HandState.h>
#include <geometry_msgs/PoseStamped.h>
#include <ros/ros.h>

#include <fabric_msgs/traffic.hpp>
#include <functional>
#include <vector>

#include "fabric_planner/safety_monitor.hpp"

namespace fabric::planner {

/// The safety monitor with its topics: `human/hand` and `arm/tcp`, both counted.
class SeparationWatch {
 public:
  using OnTool = std::function<void(const ToolPose&)>;
  using OnSeparation = std::function<void(const SeparationState&)>;

  /// on_separation: called with every judgement, at least with each message of the hand.
  SeparationWatch(msgs::Traffic& traffic, SafetyMonitor monitor, const ArmPlace& arm,
                  OnTool on_tool, OnSeparation on_separation);

  /// Looks at the age of what is known. Judges only when some of it is too old: in simulation,
  /// where time waits for messages, that is never so, and judgements come with messages alone.
  void look(const ros::Time& now);

  [[nodiscard]] const SeparationState& state() const { return monitor_.state(); }
  [[nodiscard]] double slowFactor() const { return monitor_.parameters().slow_factor; }

 private:
  void onTool(const geometry_msgs::PoseStamped& message);
  void onHand(const fabric_msgs::HandState& message);
  void judge(double now);

  SafetyMonitor monitor_;
  ArmPlace arm_;
  OnTool on_tool_;
  OnSeparation on_separation_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace fabric::planner
