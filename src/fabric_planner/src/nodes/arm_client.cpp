// SPDX-License-Identifier: BSD-3-Clause
#include "arm_client.hpp"

#include <cmath>
#include <utility>

namespace fabric::planner {
namespace {

/// The status decides; a result that the action's server did not fill in says REACHED (0).
ArmOutcome outcomeOf(const fabric_msgs::MoveArmActionResult& message) {
  using Status = actionlib_msgs::GoalStatus;
  using Result = fabric_msgs::MoveArmResult;
  switch (message.status.status) {
    case Status::SUCCEEDED:
      return ArmOutcome::REACHED;
    case Status::PREEMPTED:
    case Status::RECALLED:
      return ArmOutcome::PRE_EMPTED;
    default:
      break;
  }
  switch (message.result.outcome) {
    case Result::UNREACHABLE:
      return ArmOutcome::UNREACHABLE;
    case Result::INVALID:
      return ArmOutcome::INVALID;
    default:
      return ArmOutcome::ARM_FAULT;
  }
}

}  // namespace

ArmClient::ArmClient(msgs::Traffic& traffic, OnResult on_result)
    : run_(ros::this_node::getName() + "-" + std::to_string(ros::WallTime::now().toNSec()) + "-"),
      on_result_(std::move(on_result)),
      goals_(traffic.advertise<fabric_msgs::MoveArmActionGoal>("arm/move/goal")),
      cancels_(traffic.advertise<actionlib_msgs::GoalID>("arm/move/cancel")),
      results_(traffic.subscribe<fabric_msgs::MoveArmActionResult>(
          "arm/move/result", [this](const auto& message) { onResult(message); })) {}

void ArmClient::move(const MotionCommand& command) {
  newest_ = command.number;
  fabric_msgs::MoveArmActionGoal goal;
  goal.header.stamp = ros::Time::now();
  goal.goal_id = idOf(command.number);
  goal.goal_id.stamp = goal.header.stamp;
  goal.goal.number = command.number;
  goal.goal.pose.position.x = command.pose.x;
  goal.goal.pose.position.y = command.pose.y;
  goal.goal.pose.position.z = command.pose.z;
  goal.goal.pose.orientation.z = std::sin(0.5 * command.pose.yaw);
  goal.goal.pose.orientation.w = std::cos(0.5 * command.pose.yaw);
  goal.goal.speed = static_cast<float>(command.speed);
  goal.goal.settle = static_cast<float>(command.settle);
  goals_.publish(goal);
}

void ArmClient::cancel(std::uint32_t number) { cancels_.publish(idOf(number)); }

bool ArmClient::connected() const { return goals_.connections() > 0; }

actionlib_msgs::GoalID ArmClient::idOf(std::uint32_t number) const {
  actionlib_msgs::GoalID id;
  id.id = run_ + std::to_string(number);
  return id;
}

void ArmClient::onResult(const fabric_msgs::MoveArmActionResult& message) {
  if (message.status.goal_id.id != idOf(newest_).id) return;
  on_result_(newest_, outcomeOf(message), message.result.reason);
}

}  // namespace fabric::planner
