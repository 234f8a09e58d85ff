// SPDX-License-Identifier: BSD-3-Clause
// `observation` in, `decision` out; `planner/set_model` changes the model, `model_info` tells it.
#include <fabric_msgs/Decision.h>
#include <fabric_msgs/ModelInfo.h>
#include <fabric_msgs/Observation.h>
#include <fabric_msgs/SetModel.h>
#include <ros/ros.h>

#include <algorithm>
#include <fabric_msgs/traffic.hpp>
#include <string>

#include "fabric_planner/decision_agent.hpp"
#include "parameters.hpp"

namespace fabric::planner {
namespace {

constexpr double TELL_AGAIN = 10.0;  // s between two warnings about the same

/// Private parameters of decision_node (config/decision.yaml, and `model` from the launch file).
struct DecisionParameters {
  std::string model;            ///< .pomdpx file
  std::string observation_map;  ///< file; empty: beside the model
  AgentOptions options;         ///< deadline s, gap, max_nodes, solver, policy, fallback action

  /// @throw ParameterError
  static DecisionParameters load(const ros::NodeHandle& node) {
    DecisionParameters parameters;
    parameters.model = require<std::string>(node, "model");
    parameters.observation_map = require<std::string>(node, "observation_map");
    PlannerOptions& limits = parameters.options.planner;
    limits.deadline = requireNumber(node, "deadline", 0.0);
    limits.gap = requireNumber(node, "gap", 0.0);
    limits.max_nodes = static_cast<int>(requireNumber(node, "max_nodes", 0.0));
    parameters.options.solver = named(node, "solver", solverFromName);
    parameters.options.policy_path = require<std::string>(node, "policy");
    parameters.options.fallback = named(node, "fallback_action", actionFromName);
    return parameters;
  }

  /// The parameter as something that has a name. @throw ParameterError
  template <class T>
  static T named(const ros::NodeHandle& node, const std::string& parameter,
                 T (*fromName)(const std::string&)) {
    const auto name = require<std::string>(node, parameter);
    try {
      return fromName(name);
    } catch (const ModelError& error) {
      throw ParameterError(node.resolveName(parameter) + ": " + error.what());
    }
  }
};

AgentObservation fromMessage(const fabric_msgs::Observation& message) {
  AgentObservation observation;
  Features& features = observation.features;
  features.task_success = message.task_success != 0;
  features.task_failure = message.task_failure != 0;
  features.detected = message.detected != 0;
  features.looking_around = message.looking_around != 0;
  features.grasp_attempt = message.grasp_attempt != 0;
  features.warning = message.warning != 0;
  features.idle = message.idle != 0;
  features.subtask_success = message.subtask_success != 0;
  features.subtask_failure = message.subtask_failure != 0;
  features.robot_success = message.robot_success != 0;
  features.robot_failure = message.robot_failure != 0;
  features.subtask_elapsed = message.subtask_elapsed;
  features.waiting_time = message.waiting_time;
  features.failed_attempts = message.failed_attempts;
  observation.sequence = message.sequence;
  observation.task_id = message.task_id;
  observation.starts_task = message.trigger == fabric_msgs::Observation::TRIGGER_START;
  return observation;
}

fabric_msgs::Decision toMessage(const AgentDecision& decision) {
  fabric_msgs::Decision message;
  message.sequence = decision.observation_sequence;
  message.observation_sequence = decision.observation_sequence;
  message.task_id = decision.task_id;
  message.model_hash = decision.model_hash;
  message.action = static_cast<std::uint8_t>(decision.action);
  message.action_index = static_cast<std::uint16_t>(decision.action_index);
  message.observation_index = static_cast<std::uint16_t>(decision.observation_index);
  message.belief.assign(decision.belief.begin(), decision.belief.end());
  message.value = decision.plan.value;
  message.lower_bound = decision.plan.lower_bound;
  message.upper_bound = decision.plan.upper_bound;
  message.runner_up = static_cast<std::int16_t>(decision.plan.runner_up);
  message.runner_up_gap = decision.plan.runner_up_gap;
  message.nodes = static_cast<std::uint32_t>(decision.plan.nodes);
  message.planning_time = decision.plan.planning_time;
  message.deadline_missed = decision.plan.deadline_missed;
  message.fallback_used = decision.plan.fallback_used;
  message.belief_recovered = decision.belief_recovered;
  return message;
}

fabric_msgs::ModelInfo toMessage(const RunningModel& model) {
  fabric_msgs::ModelInfo info;
  info.header.stamp = ros::Time::now();
  info.name = model.name;
  info.path = model.path;
  info.hash = model.hash;
  info.discount = model.pomdp->discount();
  info.states = model.pomdp->states();
  info.actions = model.pomdp->actions();
  info.observations = model.pomdp->observations();
  info.fully_observable = model.pomdp->fullyObservable();
  return info;
}

/// Callbacks run one after the other, so observations queue while a decision is made.
class DecisionNode {
 public:
  explicit DecisionNode(const DecisionParameters& parameters)
      : agent_(parameters.model, parameters.options, parameters.observation_map),
        traffic_(node_, "decision"),
        decisions_(traffic_.advertise<fabric_msgs::Decision>("decision")),
        model_info_(node_.advertise<fabric_msgs::ModelInfo>("model_info", 1, true)),
        set_model_(node_.advertiseService("planner/set_model", &DecisionNode::onSetModel, this)),
        observations_(traffic_.subscribe<fabric_msgs::Observation>(
            "observation", [this](const auto& message) { onObservation(message); })) {
    model_info_.publish(toMessage(agent_.model()));
  }

 private:
  void onObservation(const fabric_msgs::Observation& message) {
    const AgentDecision decided = agent_.decide(fromMessage(message));
    if (!decided.trouble.empty()) {
      ROS_WARN_STREAM_THROTTLE(TELL_AGAIN, "fallback action taken: " << decided.trouble);
    }
    fabric_msgs::Decision decision = toMessage(decided);
    decision.header.stamp = std::max(ros::Time::now(), message.header.stamp);
    decisions_.publish(decision);
  }

  bool onSetModel(fabric_msgs::SetModel::Request& request,
                  fabric_msgs::SetModel::Response& response) {
    try {
      agent_.setModel(request.path, request.keep_belief != 0);
      response.accepted = true;
    } catch (const std::exception& error) {
      response.accepted = false;
      response.reason = error.what();
    }
    response.info = toMessage(agent_.model());
    if (response.accepted) model_info_.publish(response.info);
    return true;
  }

  ros::NodeHandle node_;
  DecisionAgent agent_;
  msgs::Traffic traffic_;
  msgs::Traffic::Publisher decisions_;
  ros::Publisher model_info_;
  ros::ServiceServer set_model_;
  ros::Subscriber observations_;
};

}  // namespace
}  // namespace fabric::planner

int main(int argc, char** argv) {
  using namespace fabric::planner;
  ros::init(argc, argv, "decision");
  try {
    DecisionNode node(DecisionParameters::load(ros::NodeHandle("~")));
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 2;
  }
  return 0;
}
