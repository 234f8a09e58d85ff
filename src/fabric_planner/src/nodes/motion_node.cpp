// SPDX-License-Identifier: BSD-3-Clause
// Decisions in, arm goals out: the motion agent with its topics, services and actions.
#include <fabric_msgs/Command.h>
#include <fabric_msgs/ConveyorState.h>
#include <fabric_msgs/CubeArray.h>
#include <fabric_msgs/Decision.h>
#include <fabric_msgs/Heartbeat.h>
#include <fabric_msgs/RobotActionState.h>
#include <fabric_msgs/SafetyState.h>
#include <fabric_msgs/SetSuction.h>
#include <fabric_msgs/Stop.h>
#include <fabric_msgs/TaskState.h>
#include <ros/ros.h>
#include <std_msgs/Header.h>

#include <fabric_msgs/traffic.hpp>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "arm_client.hpp"
#include "execute_server.hpp"
#include "fabric_planner/motion_agent.hpp"
#include "parameters.hpp"
#include "separation.hpp"

namespace fabric::planner {
namespace {

constexpr double PERIOD = 0.05;  // s of steady time between repeats of robot/state

/// Private parameters of motion_node (config/motion_node.yaml, `motion_file` from the launch file).
struct MotionParameters {
  std::string motion_file;           ///< places, speeds and gestures (config/motion.yaml)
  std::vector<std::string> watched;  ///< nodes whose heartbeats' ages are told
  bool separation = false;           ///< whether the hand is watched; then `human/hand` is expected
  std::string safety_file;           ///< with separation: distances (config/safety.yaml)
  std::string limits_file;           ///< with separation: lengths of the arm (magician.yaml)
  std::string cell_file;             ///< with separation: where the arm stands (cell.yaml)

  /// @throw ParameterError
  static MotionParameters load(const ros::NodeHandle& node) {
    MotionParameters parameters{require<std::string>(node, "motion_file"),
                                require<std::vector<std::string>>(node, "watched"),
                                require<bool>(node, "separation"),
                                "",
                                "",
                                ""};
    if (parameters.separation) {
      parameters.safety_file = require<std::string>(node, "safety_file");
      parameters.limits_file = require<std::string>(node, "limits_file");
      parameters.cell_file = require<std::string>(node, "cell_file");
    }
    return parameters;
  }
};

std::uint8_t number(const std::optional<Action>& action) {
  return action ? static_cast<std::uint8_t>(*action)
                : static_cast<std::uint8_t>(fabric_msgs::RobotActionState::NONE);
}

fabric_msgs::RobotActionState toMessage(const RobotState& state) {
  fabric_msgs::RobotActionState message;
  message.header.stamp = ros::Time::now();
  message.sequence = state.sequence;
  message.current = number(state.current);
  message.queued = number(state.queued);
  message.pre_empted = number(state.pre_empted);
  message.phase = static_cast<std::uint8_t>(state.phase);
  message.holding = state.holding;
  message.lost = state.lost;
  message.planned = state.planned;
  message.decision_sequence = state.decision_sequence;
  return message;
}

std::vector<SeenCube> fromMessage(const fabric_msgs::CubeArray& message) {
  std::vector<SeenCube> cubes;
  for (const auto& cube : message.cubes)
    cubes.push_back({cube.colour, cube.where, cube.confidence, cube.id});
  return cubes;
}

TaskView fromMessage(const fabric_msgs::TaskState& message) {
  TaskView task{message.task_id, message.status, message.scenario, {}};
  for (const auto& rule : message.rules) task.rules.emplace_back(rule.colour, rule.label);
  task.cube_rules = message.cube_rules;
  return task;
}

class MotionNode {
 public:
  explicit MotionNode(const MotionParameters& parameters)
      : agent_(MotionConfig::load(parameters.motion_file)),
        traffic_(node_, "motion"),
        states_(traffic_.advertise<fabric_msgs::RobotActionState>("robot/state")),
        safety_(node_.advertise<fabric_msgs::SafetyState>("safety/state", 10)),
        suction_(node_.serviceClient<fabric_msgs::SetSuction>("arm/set_suction")),
        arm_(traffic_, [this](auto... result) { run(agent_.onArmResult(result...)); }),
        execute_(node_, [this](const auto& goal, const auto& ticketed) {
          const MotionCommands commands = request(goal);
          ticketed(agent_.ticket());
          run(commands);
        }) {
    if (parameters.separation) watch(parameters);
    for (const std::string& name : parameters.watched) heard_[name] = ros::SteadyTime::now();
    listen();
    services_ = {node_.advertiseService("safety/stop", &MotionNode::onStop, this),
                 node_.advertiseService("safety/release", &MotionNode::onRelease, this)};
    timer_ = node_.createSteadyTimer(ros::WallDuration(PERIOD),
                                     [this](const ros::SteadyTimerEvent&) { onTimer(); });
  }

 private:
  MotionCommands request(const fabric_msgs::ExecuteRobotActionGoal& goal) {
    if (!goal.gesture.empty()) return agent_.onGesture(goal.gesture, goal.decision_sequence);
    return agent_.onDecision(actionFromNumber(goal.action), goal.decision_sequence);
  }

  void watch(const MotionParameters& parameters) {
    separation_ = std::make_unique<SeparationWatch>(
        traffic_,
        SafetyMonitor(SafetyParameters::load(parameters.safety_file),
                      ArmLinks::load(parameters.limits_file)),
        ArmPlace::load(parameters.cell_file), [this](const ToolPose& tool) { agent_.onTool(tool); },
        [this](const SeparationState& state) {
          run(agent_.onSeparation(state.level, separation_->slowFactor()));
        });
    separation_->look(ros::Time(0));
  }

  void listen() {
    listen<fabric_msgs::Decision>("decision", [this](const auto& message) {
      return agent_.onDecision(actionFromNumber(message.action), message.sequence, message.task_id);
    });
    listen<fabric_msgs::ConveyorState>("conveyor/state", [this](const auto& message) {
      return agent_.onConveyor(message.cube_at_pick_point != 0);
    });
    listen<fabric_msgs::CubeArray>(
        "cell/cubes", [this](const auto& message) { return agent_.onCubes(fromMessage(message)); });
    listen<fabric_msgs::TaskState>(
        "task/state", [this](const auto& message) { return agent_.onTask(fromMessage(message)); });
    listen<std_msgs::Header>("human/warning", [this](const auto&) { return agent_.onWarning(); });
    subscribers_.push_back(node_.subscribe("heartbeat", 100, &MotionNode::onHeartbeat, this));
  }

  template <class M>
  void listen(const std::string& topic, std::function<MotionCommands(const M&)> react) {
    subscribers_.push_back(traffic_.subscribe<M>(
        topic, [this, react = std::move(react)](const M& message) { run(react(message)); }));
  }

  /// Carries out what an event caused and tells what became of it.
  void run(const MotionCommands& commands) {
    std::string suction_failure;
    for (const MotionCommand& command : commands) {
      switch (command.kind) {
        case MotionCommand::Kind::MOVE:
          arm_.move(command);
          break;
        case MotionCommand::Kind::CANCEL:
          arm_.cancel(command.number);
          break;
        case MotionCommand::Kind::SUCTION_ON:
        case MotionCommand::Kind::SUCTION_OFF:
          setSuction(command.kind == MotionCommand::Kind::SUCTION_ON, suction_failure);
      }
    }
    if (!suction_failure.empty()) return run(agent_.onSuctionFailure(suction_failure));
    report();
  }

  void setSuction(bool on, std::string& failure) {
    fabric_msgs::SetSuction call;
    call.request.on = on;
    if (!suction_.call(call)) {
      failure = "arm/set_suction does not answer";
    } else if (!call.response.accepted) {
      failure = "arm/set_suction refuses: " + call.response.reason;
    }
  }

  void report() {
    for (const ActionEnd& end : agent_.takeEnds()) {
      execute_.end(end);
      if (end.outcome == ActionOutcome::ARM_FAILED) {
        ROS_ERROR_STREAM_THROTTLE(1.0, actionName(end.action) << " failed: " << end.reason);
      } else if (end.outcome == ActionOutcome::CUBE_LOST) {
        ROS_WARN_STREAM(actionName(end.action) << " ended: " << end.reason);
      }
    }
    if (agent_.state().sequence == told_) return;
    told_ = agent_.state().sequence;
    states_.publish(toMessage(agent_.state()), told_);
    execute_.feedback(agent_.state().phase);
  }

  void onTimer() {
    const auto move = agent_.outstanding();
    if (move && !arm_.connected()) {
      run(agent_.onArmResult(*move, ArmOutcome::ARM_FAULT, "no arm serves arm/move"));
    }
    if (separation_) separation_->look(ros::Time::now());
    states_.repeat(toMessage(agent_.state()));
    safety_.publish(safety());
  }

  fabric_msgs::SafetyState safety() const {
    fabric_msgs::SafetyState message;
    message.header.stamp = ros::Time::now();
    message.state = fabric_msgs::SafetyState::RUN;
    message.separation = std::numeric_limits<float>::quiet_NaN();
    if (separation_) {
      message.state = static_cast<std::uint8_t>(separation_->state().level);
      message.cause = separation_->state().cause;
      message.separation = static_cast<float>(separation_->state().distance);
    }
    if (agent_.heldByWarning() && message.state != fabric_msgs::SafetyState::STOP) {
      message.state = fabric_msgs::SafetyState::SLOW;
      message.cause = "a warning holds the arm until the next decision";
    }
    if (agent_.stopped()) {
      message.state = fabric_msgs::SafetyState::STOP;
      message.cause = agent_.cause();
    }
    const ros::SteadyTime now = ros::SteadyTime::now();
    for (const auto& [name, time] : heard_) {
      message.watched.push_back(name);
      message.age.push_back(static_cast<float>((now - time).toSec()));
    }
    return message;
  }

  void onHeartbeat(const fabric_msgs::Heartbeat::ConstPtr& message) {
    const auto found = heard_.find(message->node);
    if (found != heard_.end()) found->second = ros::SteadyTime::now();
  }

  bool onStop(fabric_msgs::Stop::Request& request, fabric_msgs::Stop::Response& response) {
    run(agent_.onStop(request.cause.empty() ? "no cause was given" : request.cause));
    response.accepted = true;
    return true;
  }

  bool onRelease(fabric_msgs::Command::Request&, fabric_msgs::Command::Response& response) {
    response.accepted = agent_.stopped();
    if (!agent_.stopped()) response.reason = "nothing is stopped";
    run(agent_.onRelease());
    return true;
  }

  ros::NodeHandle node_;
  MotionAgent agent_;
  msgs::Traffic traffic_;
  msgs::Traffic::Publisher states_;
  ros::Publisher safety_;
  ros::ServiceClient suction_;
  ArmClient arm_;
  ExecuteServer execute_;
  std::unique_ptr<SeparationWatch> separation_;  ///< none when the hand is not watched
  std::uint32_t told_ = 0;
  std::map<std::string, ros::SteadyTime> heard_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::SteadyTimer timer_;
};

}  // namespace
}  // namespace fabric::planner

int main(int argc, char** argv) {
  using namespace fabric::planner;
  ros::init(argc, argv, "motion");
  try {
    MotionNode node(MotionParameters::load(ros::NodeHandle("~")));
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 2;
  }
  return 0;
}
