// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <memory>
#include <variant>

#include "bindings.hpp"
#include "fabric_planner/arbiter.hpp"
#include "fabric_planner/motion_agent.hpp"
#include "fabric_planner/pomdp.hpp"
#include "fabric_planner/safety_monitor.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

constexpr int NONE = 255;  // fabric_msgs/RobotActionState

using ActionLike = std::variant<int, std::string>;

Action toAction(const ActionLike& action) {
  if (std::holds_alternative<int>(action)) return actionFromNumber(std::get<int>(action));
  return actionFromName(std::get<std::string>(action));
}

ArmOutcome toArmOutcome(int outcome) {
  if (outcome >= 0 && outcome <= 4) return static_cast<ArmOutcome>(outcome);
  throw ModelError("arm outcome " + std::to_string(outcome) + " is none of 0 to 4");
}

int number(const std::optional<Action>& action) {
  return action ? static_cast<int>(*action) : NONE;
}

std::vector<SeenCube> toCubes(const py::object& array) {
  std::vector<SeenCube> cubes;
  for (const py::handle cube : array.attr("cubes")) {
    cubes.push_back({cube.attr("colour").cast<int>(), cube.attr("where").cast<int>(),
                     cube.attr("confidence").cast<double>(),
                     cube.attr("id").cast<std::uint32_t>()});
  }
  return cubes;
}

TaskView toTask(const py::object& state) {
  TaskView task{state.attr("task_id").cast<std::uint32_t>(),
                state.attr("status").cast<int>(),
                state.attr("scenario").cast<std::string>(),
                {}};
  for (const py::handle rule : state.attr("rules")) {
    task.rules.emplace_back(rule.attr("colour").cast<int>(),
                            rule.attr("label").cast<std::string>());
  }
  for (const py::handle index : state.attr("cube_rules")) {  // rospy reads them as bytes
    task.cube_rules.push_back(index.cast<std::uint8_t>());
  }
  return task;
}

py::object fill(const RobotState& state, py::object message) {
  message.attr("sequence") = state.sequence;
  message.attr("current") = number(state.current);
  message.attr("queued") = number(state.queued);
  message.attr("pre_empted") = number(state.pre_empted);
  message.attr("phase") = static_cast<int>(state.phase);
  message.attr("holding") = state.holding;
  message.attr("lost") = state.lost;
  message.attr("planned") = state.planned;
  message.attr("decision_sequence") = state.decision_sequence;
  return message;
}

const char* kindName(MotionCommand::Kind kind) {
  switch (kind) {
    case MotionCommand::Kind::MOVE:
      return "MOVE";
    case MotionCommand::Kind::CANCEL:
      return "CANCEL";
    case MotionCommand::Kind::SUCTION_ON:
      return "SUCTION_ON";
    default:
      return "SUCTION_OFF";
  }
}

void bindCommand(py::module_& module) {
  py::enum_<MotionCommand::Kind>(module, "CommandKind")
      .value("MOVE", MotionCommand::Kind::MOVE)
      .value("CANCEL", MotionCommand::Kind::CANCEL)
      .value("SUCTION_ON", MotionCommand::Kind::SUCTION_ON)
      .value("SUCTION_OFF", MotionCommand::Kind::SUCTION_OFF);
  py::class_<MotionCommand>(module, "MotionCommand", "One command for the arm: m, rad, m/s, s.")
      .def_readonly("kind", &MotionCommand::kind)
      .def_readonly("number", &MotionCommand::number, "of the move; 0 for suction")
      .def_property_readonly("x", [](const MotionCommand& c) { return c.pose.x; })
      .def_property_readonly("y", [](const MotionCommand& c) { return c.pose.y; })
      .def_property_readonly("z", [](const MotionCommand& c) { return c.pose.z; })
      .def_property_readonly("yaw", [](const MotionCommand& c) { return c.pose.yaw; })
      .def_property_readonly(
          "parts",
          [](const MotionCommand& c) {
            return py::make_tuple(kindName(c.kind), c.number, c.pose.x, c.pose.y, c.pose.z,
                                  c.pose.yaw, c.speed, c.settle);
          },
          "(name of the kind, number, x, y, z, yaw, speed, settle), read at once")
      .def_readonly("speed", &MotionCommand::speed)
      .def_readonly("settle", &MotionCommand::settle)
      .def("__repr__", [](const MotionCommand& c) {
        return py::str("<{} {} ({:.3f}, {:.3f}, {:.3f})>")
            .format(py::cast(c.kind).attr("name"), c.number, c.pose.x, c.pose.y, c.pose.z);
      });
}

void bindState(py::module_& module) {
  py::class_<RobotState>(module, "RobotState", "The fields of fabric_msgs/RobotActionState.")
      .def_readonly("sequence", &RobotState::sequence)
      .def_property_readonly("current", [](const RobotState& s) { return number(s.current); })
      .def_property_readonly("queued", [](const RobotState& s) { return number(s.queued); })
      .def_property_readonly("pre_empted", [](const RobotState& s) { return number(s.pre_empted); })
      .def_property_readonly("phase", [](const RobotState& s) { return static_cast<int>(s.phase); })
      .def_readonly("holding", &RobotState::holding)
      .def_readonly("lost", &RobotState::lost)
      .def_readonly("planned", &RobotState::planned)
      .def_readonly("decision_sequence", &RobotState::decision_sequence)
      .def("fill", &fill, "message"_a,
           "Set the fields of a fabric_msgs/RobotActionState but its header; returns the message.");
}

void bindEnd(py::module_& module) {
  py::class_<ActionEnd>(module, "ActionEnd", "How one request for an action ended.")
      .def_readonly("ticket", &ActionEnd::ticket)
      .def_property_readonly("action",
                             [](const ActionEnd& e) { return static_cast<int>(e.action); })
      .def_property_readonly(
          "outcome", [](const ActionEnd& e) { return static_cast<int>(e.outcome); },
          "ExecuteRobotActionResult.DONE..CUBE_LOST")
      .def_readonly("reason", &ActionEnd::reason);
}

void bindArbiter(py::module_& module) {
  py::enum_<Verdict>(module, "Verdict")
      .value("START", Verdict::START)
      .value("CONTINUE", Verdict::CONTINUE)
      .value("PRE_EMPT", Verdict::PRE_EMPT)
      .value("QUEUE", Verdict::QUEUE);
  module.def(
      "arbitrate",
      [](const std::optional<ActionLike>& running, const ActionLike& next) {
        return arbitrate(running ? std::optional(toAction(*running)) : std::nullopt,
                         toAction(next));
      },
      "running"_a, "next"_a, "Table 6.5; running: None when nothing runs.");
}

/// name -> name of the action it stands for
std::map<std::string, std::string> gesturesOf(const MotionConfig& config) {
  std::map<std::string, std::string> gestures;
  for (const auto& [name, gesture] : config.gestures) gestures[name] = actionName(gesture.action);
  return gestures;
}

/// A fabric_msgs/HandState in the frame of the arm.
SeenHand toHand(const py::object& message, const ArmPlace& arm) {
  const py::object place = message.attr("position");
  const Point3 point{place.attr("x").cast<double>(), place.attr("y").cast<double>(),
                     place.attr("z").cast<double>()};
  const double stamp = message.attr("header").attr("stamp").attr("to_sec")().cast<double>();
  return {stamp, message.attr("visible").cast<bool>(), arm.fromCell(point),
          message.attr("age").cast<double>()};
}

void bindSafety(py::module_& module) {
  py::enum_<Separation>(module, "Separation", "Numbered as in fabric_msgs/SafetyState.")
      .value("RUN", Separation::RUN)
      .value("SLOW", Separation::SLOW)
      .value("STOP", Separation::STOP);
  py::class_<SeparationState>(module, "SeparationState", "What hand and arm allow.")
      .def_readonly("level", &SeparationState::level)
      .def_readonly("distance", &SeparationState::distance, "m; infinite with nobody there")
      .def_readonly("cause", &SeparationState::cause, "empty when RUN");
  py::class_<ArmPlace>(module, "ArmPlace", "Where the arm stands in the cell.")
      .def_static("load", &ArmPlace::load, "path"_a, "path: of a cell.yaml. Raises ModelError.");
  py::class_<SafetyMonitor>(module, "SafetyMonitor", "Speed and separation (docs/motion.md).")
      .def(py::init([](const std::string& safety, const std::string& limits) {
             return std::make_unique<SafetyMonitor>(SafetyParameters::load(safety),
                                                    ArmLinks::load(limits));
           }),
           "safety"_a, "limits"_a, "Paths of a safety.yaml and a magician.yaml. Raises ModelError.")
      .def(
          "on_tool",
          [](SafetyMonitor& monitor, double stamp, double x, double y, double z) {
            monitor.onTool(stamp, {x, y, z});
          },
          "stamp"_a, "x"_a, "y"_a, "z"_a, "s; m in arm_base_link")
      .def(
          "on_hand",
          [](SafetyMonitor& monitor, const py::object& message, const ArmPlace& arm) {
            monitor.onHand(toHand(message, arm));
          },
          "message"_a, "arm"_a, "message: a fabric_msgs/HandState.")
      .def("assess", &SafetyMonitor::assess, "now"_a, py::return_value_policy::copy, "now: s")
      .def_property_readonly("newest", &SafetyMonitor::newest, "stamp of the newest message, s")
      .def_property_readonly(
          "slow_factor",
          [](const SafetyMonitor& monitor) { return monitor.parameters().slow_factor; })
      .def(
          "links",
          [](const SafetyMonitor& monitor, double x, double y, double z) {
            std::vector<std::array<double, 3>> joints;
            for (const Point3& p : monitor.links({x, y, z})) joints.push_back({p.x, p.y, p.z});
            return joints;
          },
          "x"_a, "y"_a, "z"_a, "base, elbow, wrist and tool, m, for a tool at this place");
}

}  // namespace

void bindMotion(py::module_& module) {
  bindArbiter(module);
  bindSafety(module);
  bindCommand(module);
  bindState(module);
  bindEnd(module);
  py::class_<MotionConfig>(module, "MotionConfig", "Places, speeds and gestures: m, rad, m/s, s.")
      .def_static("load", &MotionConfig::load, "path"_a, "Raises ModelError naming the entry.")
      .def_static("parse", &MotionConfig::parse, "text"_a, "name"_a)
      .def_property_readonly("gestures", &gesturesOf, "dict: name -> the action it stands for");
  py::class_<MotionAgent>(module, "MotionAgent",
                          "Turns decisions into arm moves. Every input returns the commands it\n"
                          "causes; at most one move is outstanding.")
      .def(py::init<MotionConfig>(), "config"_a)
      .def(py::init([](const std::string& path) {
             return std::make_unique<MotionAgent>(MotionConfig::load(path));
           }),
           "path"_a, "path: of a motion.yaml. Raises ModelError.")
      .def(
          "on_decision",
          [](MotionAgent& agent, const ActionLike& action, std::uint32_t sequence,
             std::uint32_t task_id) {
            return agent.onDecision(toAction(action), sequence, task_id);
          },
          "action"_a, "sequence"_a, "task_id"_a = 0, "action: a number of Decision or a name.")
      .def("on_gesture", &MotionAgent::onGesture, "name"_a, "sequence"_a = 0,
           "Plays a gesture of the motion file. Raises ModelError when there is none of the name.")
      .def(
          "on_arm_result",
          [](MotionAgent& agent, std::uint32_t move, int outcome, const std::string& reason) {
            return agent.onArmResult(move, toArmOutcome(outcome), reason);
          },
          "number"_a, "outcome"_a, "reason"_a = "", "outcome: MoveArmResult.REACHED..ARM_FAULT.")
      .def("on_suction_failure", &MotionAgent::onSuctionFailure, "reason"_a)
      .def("on_conveyor", &MotionAgent::onConveyor, "cube_at_pick_point"_a)
      .def(
          "on_cubes",
          [](MotionAgent& agent, const py::object& cubes) { return agent.onCubes(toCubes(cubes)); },
          "cubes"_a, "cubes: a fabric_msgs/CubeArray.")
      .def(
          "on_task",
          [](MotionAgent& agent, const py::object& state) { return agent.onTask(toTask(state)); },
          "state"_a, "state: a fabric_msgs/TaskState.")
      .def("on_warning", &MotionAgent::onWarning)
      .def(
          "on_tool",
          [](MotionAgent& agent, double x, double y, double z) {
            agent.onTool({x, y, z, 0.0});
          },
          "x"_a, "y"_a, "z"_a, "Where the tool is, m in arm_base_link.")
      .def("on_separation", &MotionAgent::onSeparation, "separation"_a, "slow_factor"_a)
      .def("on_stop", &MotionAgent::onStop, "cause"_a)
      .def("on_release", &MotionAgent::onRelease)
      .def("state", &MotionAgent::state, py::return_value_policy::copy)
      .def_property_readonly(
          "state_sequence", [](const MotionAgent& agent) { return agent.state().sequence; },
          "state().sequence, without the rest")
      .def_property_readonly("stopped", &MotionAgent::stopped)
      .def_property_readonly("held_by_warning", &MotionAgent::heldByWarning)
      .def_property_readonly("cause", &MotionAgent::cause)
      .def_property_readonly("outstanding", &MotionAgent::outstanding,
                             "Number of the outstanding move, None without one.")
      .def_property_readonly("ticket", &MotionAgent::ticket, "Of the newest on_decision.")
      .def("take_ends", &MotionAgent::takeEnds, "The ends of actions since the last call.");
}

}  // namespace fabric::planner
