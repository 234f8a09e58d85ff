// SPDX-License-Identifier: BSD-3-Clause
#include "gesture_file.hpp"

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {
namespace {

std::string listed(const std::map<std::string, ToolPose>& poses) {
  std::string list = BACK + ", " + TRAY;
  for (const auto& [name, pose] : poses) list += ", " + name;
  return list;
}

std::string placeName(const yaml::Section& step, const MotionConfig& config) {
  std::string name = step.text("pose");
  if (name == TRAY || name == BACK || config.poses.count(name) > 0) return name;
  throw ModelError(step.placeOf("pose") + ": there is no pose '" + name +
                   "'; known: " + listed(config.poses));
}

/// m/s: the name of a speed, or a number.
double speed(const yaml::Section& step, const MotionConfig& config) {
  const YAML::Node node = step.node("speed");
  if (node && node.IsScalar()) {
    const auto found = config.speeds.find(node.Scalar());
    if (found != config.speeds.end()) return found->second;
  }
  return step.positive("speed");
}

ToolPose offset(const yaml::Section& step) {
  if (!step.has("offset")) return {};
  const yaml::Section entry(step.node("offset"), step.placeOf("offset"), {"x", "y", "z", "yaw"});
  const auto part = [&entry](const std::string& key) {
    return entry.has(key) ? entry.number(key) : 0.0;
  };
  return {part("x"), part("y"), part("z"), part("yaw")};
}

bool above(const yaml::Section& step, const std::string& place) {
  if (!step.has("above") || !yaml::boolean(step.node("above"), step.placeOf("above"))) return false;
  if (!hasHeight(place)) {
    throw ModelError(step.placeOf("above") + ": `heights` gives none over '" + place + "'");
  }
  if (step.has("offset")) throw ModelError(step.placeOf("above") + ": not together with offset");
  return true;
}

GestureStep readStep(const YAML::Node& node, const std::string& place, const MotionConfig& config) {
  if (node.IsMap() && node["suction"]) {
    const yaml::Section step(node, place, {"suction"});
    return {yaml::boolean(step.node("suction"), step.placeOf("suction")), {}};
  }
  const yaml::Section step(node, place, {"pose", "above", "offset", "speed", "hold", "suction"});
  WayPoint way_point;
  way_point.place = placeName(step, config);
  way_point.above = above(step, way_point.place);
  way_point.offset = offset(step);
  way_point.speed = speed(step, config);
  if (step.has("hold")) way_point.hold = step.atLeastZero("hold");
  return {std::nullopt, way_point};
}

}  // namespace

Gesture readGesture(const YAML::Node& node, const std::string& place, const MotionConfig& config) {
  const yaml::Section entry(node, place, {"action", "steps"});
  Gesture gesture;
  gesture.action = actionFromName(entry.text("action"));
  const YAML::Node steps = entry.node("steps");
  if (!steps || !steps.IsSequence() || steps.size() == 0) {
    throw ModelError(entry.placeOf("steps") + ": expected a list with at least one step");
  }
  for (const YAML::Node& step : steps) {
    const std::string number = std::to_string(gesture.steps.size() + 1);
    gesture.steps.push_back(readStep(step, place + ": step " + number, config));
  }
  return gesture;
}

}  // namespace fabric::planner
