// SPDX-License-Identifier: BSD-3-Clause
#include "execute_server.hpp"

#include <utility>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {
namespace {

fabric_msgs::ExecuteRobotActionResult resultOf(ActionOutcome outcome, const std::string& reason) {
  fabric_msgs::ExecuteRobotActionResult result;
  result.outcome = static_cast<std::uint8_t>(outcome);
  result.reason = reason;
  return result;
}

}  // namespace

ExecuteServer::ExecuteServer(const ros::NodeHandle& node, Request request)
    : request_(std::move(request)),
      server_(
          node, "robot/execute", [this](Server::GoalHandle goal) { onGoal(goal); },
          [this](Server::GoalHandle goal) { onCancel(goal); }, false) {
  server_.start();
}

void ExecuteServer::end(const ActionEnd& end) {
  const auto found = goals_.find(end.ticket);
  if (found == goals_.end()) return;
  Server::GoalHandle goal = found->second;
  goals_.erase(found);
  const auto result = resultOf(end.outcome, end.reason);
  if (end.outcome == ActionOutcome::DONE) {
    goal.setSucceeded(result);
  } else if (goal.getGoalStatus().status == actionlib_msgs::GoalStatus::PREEMPTING) {
    goal.setCanceled(result, end.reason);
  } else {
    goal.setAborted(result, end.reason);
  }
}

void ExecuteServer::feedback(Phase phase) {
  fabric_msgs::ExecuteRobotActionFeedback feedback;
  feedback.phase = static_cast<std::uint8_t>(phase);
  for (auto& [ticket, goal] : goals_) goal.publishFeedback(feedback);
}

void ExecuteServer::onGoal(Server::GoalHandle goal) {
  try {
    request_(*goal.getGoal(), [&](std::uint64_t ticket) {
      goal.setAccepted();
      goals_.emplace(ticket, goal);
    });
  } catch (const ModelError& error) {
    goal.setRejected(resultOf(ActionOutcome::REFUSED, error.what()), error.what());
  }
}

/// Whoever takes back a request wants the robot out of the way.
void ExecuteServer::onCancel(Server::GoalHandle) {
  fabric_msgs::ExecuteRobotActionGoal cancel;
  cancel.action = static_cast<std::uint8_t>(Action::CANCEL);
  request_(cancel, [](std::uint64_t) {});
}

}  // namespace fabric::planner
