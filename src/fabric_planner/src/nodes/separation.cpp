// SPDX-License-Identifier: BSD-3-Clause
#include "separation.hpp"

#include <utility>

namespace fabric::planner {

SeparationWatch::SeparationWatch(msgs::Traffic& traffic, SafetyMonitor monitor, const ArmPlace& arm,
                                 OnTool on_tool, OnSeparation on_separation)
    : monitor_(std::move(monitor)),
      arm_(arm),
      on_tool_(std::move(on_tool)),
      on_separation_(std::move(on_separation)) {
  subscribers_ = {traffic.subscribe<geometry_msgs::PoseStamped>(
                      "arm/tcp", [this](const auto& message) { onTool(message); }),
                  traffic.subscribe<fabric_msgs::HandState>(
                      "human/hand", [this](const auto& message) { onHand(message); })};
}

void SeparationWatch::look(const ros::Time& now) {
  if (!monitor_.trusts(now.toSec())) judge(now.toSec());
}

void SeparationWatch::onTool(const geometry_msgs::PoseStamped& message) {
  const auto& p = message.pose.position;
  monitor_.onTool(message.header.stamp.toSec(), {p.x, p.y, p.z});
  on_tool_({p.x, p.y, p.z, 0.0});
}

void SeparationWatch::onHand(const fabric_msgs::HandState& message) {
  const auto& p = message.position;
  const Point3 position = arm_.fromCell({p.x, p.y, p.z});
  monitor_.onHand({message.header.stamp.toSec(), message.visible != 0, position, message.age});
  judge(monitor_.newest());
}

void SeparationWatch::judge(double now) {
  const Separation before = monitor_.state().level;
  const SeparationState& state = monitor_.assess(now);
  if (state.level > before) {
    ROS_WARN_STREAM("motion: " << (state.level == Separation::STOP ? "stops" : "goes slowly")
                               << ": " << state.cause);
  } else if (state.level < before) {
    ROS_INFO_STREAM("motion: " << (state.level == Separation::RUN ? "goes on" : "goes on slowly")
                               << "; the hand is " << state.distance << " m from the arm");
  }
  on_separation_(state);
}

}  // namespace fabric::planner
