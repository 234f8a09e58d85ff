// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <actionlib_msgs/GoalID.h>
#include <fabric_msgs/MoveArmActionGoal.h>
#include <fabric_msgs/MoveArmActionResult.h>
#include <ros/ros.h>

#include <cstdint>
#include <fabric_msgs/traffic.hpp>
#include <functional>
#include <string>

#include "fabric_planner/motion_agent.hpp"

namespace fabric::planner {

/// Client of the action `arm/move` that counts goals, cancellations and results.
///
/// It speaks the action's topics itself, because every result has to be counted, and the
/// library's clients keep those of goals they no longer track to themselves.
class ArmClient {
 public:
  using OnResult =
      std::function<void(std::uint32_t number, ArmOutcome outcome, const std::string& reason)>;

  ArmClient(msgs::Traffic& traffic, OnResult on_result);

  void move(const MotionCommand& command);
  void cancel(std::uint32_t number);
  /// An arm server listens.
  [[nodiscard]] bool connected() const;

 private:
  [[nodiscard]] actionlib_msgs::GoalID idOf(std::uint32_t number) const;
  void onResult(const fabric_msgs::MoveArmActionResult& message);

  std::string run_;  ///< makes ids of this node's goals unique
  OnResult on_result_;
  msgs::Traffic::Publisher goals_;
  msgs::Traffic::Publisher cancels_;
  ros::Subscriber results_;
  std::uint32_t newest_ = 0;
};

}  // namespace fabric::planner
