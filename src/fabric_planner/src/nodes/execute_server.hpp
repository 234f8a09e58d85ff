// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <actionlib/server/action_server.h>
#include <fabric_msgs/ExecuteRobotActionAction.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <map>

#include "fabric_planner/motion_agent.hpp"

namespace fabric::planner {

/// The action `robot/execute`: hands requests to the motion agent and tells how they ended.
class ExecuteServer {
 public:
  /// Asks the motion agent for an action or a gesture; calls `ticketed` with the request's ticket
  /// before it reports any end. @throw ModelError when there is no such action or gesture
  using Request = std::function<void(const fabric_msgs::ExecuteRobotActionGoal& goal,
                                     const std::function<void(std::uint64_t)>& ticketed)>;

  ExecuteServer(const ros::NodeHandle& node, Request request);

  /// Tells the client of a request how it ended; other requests have no client.
  void end(const ActionEnd& end);
  void feedback(Phase phase);

 private:
  using Server = actionlib::ActionServer<fabric_msgs::ExecuteRobotActionAction>;

  void onGoal(Server::GoalHandle goal);
  void onCancel(Server::GoalHandle goal);

  Request request_;
  std::map<std::uint64_t, Server::GoalHandle> goals_;  ///< by ticket
  Server server_;
};

}  // namespace fabric::planner
